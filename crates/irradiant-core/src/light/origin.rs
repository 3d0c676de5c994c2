//! Which of the author's lights a compiled light is part of: a mesh that emits is one light to its author, and one for each
//! of its faces to us.

use crate::interaction::LightId;

/// A light as its author stated it: one `LightSource`, or all shapes under one `AreaLightSource`.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct LightOrigin {
    /// Kind in the words of scene files: "diffuse" for area lights, "infinite", "point" and so on.
    pub kind: &'static str,
    /// The light group that its author put it in.
    pub group: Option<String>,
}

/// The author's lights, and which of them each compiled light is part of.
#[derive(Clone, Debug, Default)]
pub struct LightOrigins {
    pub(super) list: Vec<LightOrigin>,
    /// By [`LightId`].
    pub(super) of_light: Vec<u32>,
}

impl LightOrigins {
    /// The author's lights that shine: area lights in the order of their first shape, then the others in the file's.
    pub fn as_slice(&self) -> &[LightOrigin] {
        &self.list
    }

    /// Index in [`Self::as_slice`].
    pub fn of(&self, light: LightId) -> usize {
        self.of_light[light.0 as usize] as usize
    }

    /// Names of the light groups, each once, in order of their first light.
    pub fn groups(&self) -> Vec<&str> {
        let mut names: Vec<&str> = Vec::new();
        for group in self.list.iter().filter_map(|o| o.group.as_deref()) {
            if !names.contains(&group) {
                names.push(group);
            }
        }
        names
    }
}
