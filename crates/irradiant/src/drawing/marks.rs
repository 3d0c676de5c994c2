//! Paths as lines in space, with what each means.

use super::DrawingOptions;
use super::canvas::Stroke;
use crate::render::Job;
use irradiant_math::Point3;
use irradiant_render::inspect::PathStory;
use irradiant_render::inspect::story::{LightEnd, LightOutcome};
use irradiant_render::record::Technique;

/// One colour for each number of scattering events before a segment; the last for all beyond.
pub(super) const BOUNCE_COLORS: [&str; 8] =
    ["#ffffff", "#ffd54a", "#ff7a59", "#ff4f9a", "#b06bff", "#5b8cff", "#2fd3e6", "#4be08a"];

/// Connections that brought no light are drawn for so many paths at most: more would hide the rest.
const BLOCKED_UP_TO: usize = 4;

/// What a line means.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) enum Ink {
    /// Part of a path, after so many scattering events.
    Segment(u32),
    /// A connection to a light that brought light, after so many scattering events.
    Lit(u32),
    /// A connection to a light that was blocked.
    Blocked,
    /// The camera itself.
    Eye,
}

impl Ink {
    pub fn look(self) -> Stroke<'static> {
        let of = |bounces: u32| BOUNCE_COLORS[(bounces as usize).min(BOUNCE_COLORS.len() - 1)];
        match self {
            Self::Segment(bounces) => Stroke { color: of(bounces), width: 2.4, opacity: 1.0, dash: "" },
            Self::Lit(bounces) => Stroke { color: of(bounces), width: 1.5, opacity: 0.95, dash: "6 5" },
            Self::Blocked => Stroke { color: "#ff6b6b", width: 1.1, opacity: 0.7, dash: "1.5 5" },
            Self::Eye => Stroke { color: "#c8cfdd", width: 1.2, opacity: 0.9, dash: "" },
        }
    }
}

/// A line in space.
#[derive(Clone, Debug)]
pub(super) struct Mark {
    pub a: Point3,
    pub b: Point3,
    pub ink: Ink,
    pub opacity: f32,
    /// `b` is a vertex of a path.
    pub is_vertex: bool,
    /// `a` is the camera.
    pub from_eye: bool,
    pub label: String,
}

/// All lines of all paths.
pub(super) fn marks(job: &Job, stories: &[PathStory], options: &DrawingOptions) -> Vec<Mark> {
    let opacity = (1.5 / (stories.len() as f32).sqrt()).clamp(0.12, 1.0);
    let (_, radius) = job.scene.geometry.bounds().bounding_sphere();
    let end = |from: Point3, to: LightEnd, share: f32| match to {
        LightEnd::Point(p) => p,
        LightEnd::Direction(w) => from + w * (share * radius.max(1e-6)),
    };
    let mut lines = Vec::new();
    for story in stories {
        let points = story.points();
        let wanted = |bounces: u32| options.bounces.as_ref().is_none_or(|range| range.contains(&bounces));
        // With a filter, as much of the path as light that passes it has travelled.
        let longest = match &options.bounces {
            None => story.vertices.len() as u32,
            Some(_) => story
                .found
                .iter()
                .filter(|f| wanted(f.contribution.bounces))
                .map(|f| match f.contribution.technique {
                    // A light that was met is a vertex itself, unless it is the sky.
                    Technique::Hit => (f.from + 1).min(story.vertices.len() as u32),
                    Technique::LightSample => f.from,
                })
                .max()
                .unwrap_or(0),
        };
        let segment = |a, b, bounces: u32| Mark {
            a,
            b,
            ink: Ink::Segment(bounces),
            opacity,
            is_vertex: true,
            from_eye: bounces == 0,
            label: if stories.len() == 1 { bounces.to_string() } else { String::new() },
        };
        // Connections first, so that paths cover them.
        for (i, vertex) in story.vertices.iter().enumerate() {
            if options.bounces.is_some() || stories.len() > BLOCKED_UP_TO {
                break;
            }
            for l in vertex.lights.iter().filter(|l| l.outcome == LightOutcome::Blocked) {
                let (a, b) = (points[i + 1], end(points[i + 1], l.to, 0.3));
                let ink = Ink::Blocked;
                lines.push(Mark { a, b, ink, opacity, is_vertex: false, from_eye: false, label: String::new() });
            }
        }
        for f in story.found.iter().filter(|f| wanted(f.contribution.bounces)) {
            let from = points[f.from as usize];
            let (a, b) = (from, end(from, f.to, 0.45));
            let ink = Ink::Lit(f.contribution.bounces);
            let from_eye = f.from == 0;
            lines.push(Mark { a, b, ink, opacity, is_vertex: false, from_eye, label: String::new() });
        }
        for i in 0..longest.min(story.vertices.len() as u32) {
            lines.push(segment(points[i as usize], points[i as usize + 1], i));
        }
        if let (Some(w), None, Some(&last)) = (story.escape, &options.bounces, points.last()) {
            let bounces = story.vertices.len() as u32;
            let mut mark = segment(last, end(last, LightEnd::Direction(w), 0.45), bounces);
            (mark.is_vertex, mark.label) = (false, String::new());
            lines.push(mark);
        }
    }
    lines
}
