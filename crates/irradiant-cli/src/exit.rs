//! Exit codes, after sysexits.h where it has one.

use crate::say::say;

/// How the program ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Exit {
    /// Done.
    Ok = 0,
    /// Something that was to be checked is not so.
    Failed = 1,
    /// The command line is wrong (clap exits with 2 by itself; settings that only the scene can judge come here).
    Usage = 2,
    /// The scene or image is wrong.
    BadInput = 65,
    /// A file is missing.
    Missing = 66,
    /// A bug in Irradiant.
    Bug = 70,
    /// Writing failed.
    Output = 74,
    /// Stopped by Ctrl-C or a termination signal before it was done, as shells number it (128 + SIGINT). What was written
    /// is a picture, not a checkpoint that a later run could take up: 75 ("requeue me, nothing is lost") would be a lie.
    Interrupted = 130,
}

impl Exit {
    /// The code for an error, after printing it to standard error.
    pub fn of(error: &irradiant::Error) -> Self {
        use irradiant::Error;
        say!("{error}");
        match error {
            Error::Scene(report) if report.only_missing_files() => Self::Missing,
            Error::Scene(_) => Self::BadInput,
            Error::Unreadable { why, .. } if why.kind() == std::io::ErrorKind::NotFound => Self::Missing,
            Error::Unreadable { .. } => Self::BadInput,
            Error::Settings(_) => Self::Usage,
            Error::Output { .. } => Self::Output,
            Error::Internal(_) => Self::Bug,
        }
    }
}
