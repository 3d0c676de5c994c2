//! The pinned elementary functions that this crate uses.

pub(crate) use irradiant_math::elementary::{exp, ln};
