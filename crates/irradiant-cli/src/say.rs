//! Messages to standard error that never end the program: `eprintln!` panics when nobody listens any more (a closed
//! terminal, `| head`), and a picture of hours would go with it.

/// As `eprintln!`, but a message that cannot be written is dropped.
macro_rules! say {
    ($($words:tt)*) => {{
        use std::io::Write as _;
        let _ = writeln!(std::io::stderr(), $($words)*);
    }};
}

pub(crate) use say;
