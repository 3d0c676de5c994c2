//! The scene description as plain data: what the author said, with the places where it was said.
//!
//! # Layout
//! [`span`] (where), [`diagnostic`] (complaints), [`assets`] (bytes by name), then [`desc`]: one struct per thing one
//! can say. Readers of file formats fill a [`SceneDesc`]; `irradiant-core` compiles it. Nothing here knows syntax,
//! acceleration structures or light transport.
#![forbid(unsafe_code)]

pub mod assets;
pub mod desc;
pub mod diagnostic;
pub mod span;

pub use assets::{AssetError, Assets};
pub use desc::SceneDesc;
pub use diagnostic::{Diagnostic, Diagnostics, Severity, printable};
pub use span::{FileId, Sources, Span, Spanned};
