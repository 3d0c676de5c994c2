//! Layers of a picture, as a user asks for them: one render taken apart by kinds of paths.

use crate::error::Error;
use crate::render::film_bytes;
use irradiant_core::film::Layer;
use irradiant_core::scene::{CompileOptions, Scene};
use irradiant_render::expression::PathExpression;
use irradiant_render::expression::automaton::UNGROUPED;
use irradiant_render::layered_path::{PathLayer, PathLayers};
use std::collections::BTreeSet;
use std::str::FromStr;

/// One or more layers. The text form (`FromStr`) is what `--aov` takes.
#[derive(Clone, Debug, PartialEq)]
pub enum Aov {
    /// `NAME=EXPRESSION`: one layer.
    Paths(PathLayer),
    /// `bounces:N`: light after exactly 0, 1, ... N scattering events (`K0` to `KN`, the terms K^i(Le) of the Neumann series),
    /// and after more (`Krest`).
    Bounces(u32),
    /// `partial:N`: light after at most 0, 1, ... N scattering events (`sum0` to `sumN`).
    PartialSums(u32),
    /// `lights`: one layer for each of the author's lights (`light0` ...).
    Lights,
    /// `groups`: one layer for each light group (`group.NAME`), and one for lights in none.
    Groups,
    /// `techniques`: light that was met by chance (`hit`) and that was sampled (`sampled`).
    Techniques,
    /// `gi`: hard shadows (`direct`), light gathered by mirrors and lenses (`caustics`), light between surfaces
    /// (`interreflections`).
    GlobalIllumination,
}

/// Bounces that may be asked for one by one.
const MOST_BOUNCES: u32 = 64;
/// Lights that get a layer each.
const MOST_LIGHTS: usize = 64;

/// Names of [`Aov`]s that are no expressions, with what they take.
const NAMED: &str = "bounces:N, partial:N, lights, groups, techniques, gi";

impl FromStr for Aov {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        if let Some((name, expression)) = text.split_once('=') {
            let name = name.trim();
            check_name(name)?;
            let expression = PathExpression::parse(expression.trim()).map_err(|why| why.to_string())?;
            return Ok(Self::Paths(PathLayer { name: name.into(), expression }));
        }
        let (word, count) = text.split_once(':').map_or((text, None), |(word, count)| (word, Some(count)));
        let number = || {
            let n = count.and_then(|c| c.trim().parse().ok()).filter(|n| *n <= MOST_BOUNCES);
            n.ok_or(format!("write {word}:N with N from 0 to {MOST_BOUNCES}, e.g. {word}:6"))
        };
        let aov = match word {
            "bounces" => return number().map(Self::Bounces),
            "partial" => return number().map(Self::PartialSums),
            "lights" => Self::Lights,
            "groups" => Self::Groups,
            "techniques" => Self::Techniques,
            "gi" => Self::GlobalIllumination,
            _ => {
                let known = ["bounces", "partial", "lights", "groups", "techniques", "gi"];
                let near = irradiant_scene::diagnostic::did_you_mean(word, known);
                let hint = near
                    .map_or(format!("write NAME=EXPRESSION, e.g. caustics=LS+DE, or one of {NAMED}"), |near| {
                        format!("did you mean \"{near}\"?")
                    });
                return Err(hint);
            }
        };
        match count {
            Some(_) => Err(format!("\"{word}\" takes no number")),
            None => Ok(aov),
        }
    }
}

fn check_name(name: &str) -> Result<(), String> {
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
    if name.is_empty() || name.len() > 64 || !name.chars().all(plain) {
        return Err(format!("\"{name}\" is no name for a layer: letters, digits, \"_\", \"-\" and \".\", at most 64"));
    }
    Ok(())
}

fn layer(name: impl Into<String>, expression: &str) -> Result<PathLayer, Error> {
    let expression = PathExpression::parse(expression).map_err(|why| Error::Settings(why.to_string()))?;
    Ok(PathLayer { name: name.into(), expression })
}

impl Aov {
    /// The layers that this means for a scene.
    pub fn layers(&self, scene: &Scene) -> Result<Vec<PathLayer>, Error> {
        let refuse = |what: String| Err(Error::Settings(what));
        let origins = scene.lights.origins();
        match self {
            Self::Paths(paths) => Ok(vec![paths.clone()]),
            Self::Bounces(n) => {
                let single = (0..=*n).map(|i| layer(format!("K{i}"), &format!("L.{{{i}}}E")));
                single.chain([layer("Krest", &format!("L.{{{},}}E", n + 1))]).collect()
            }
            Self::PartialSums(n) => (0..=*n).map(|i| layer(format!("sum{i}"), &format!("L.{{0,{i}}}E"))).collect(),
            Self::Lights if origins.as_slice().len() > MOST_LIGHTS => refuse(format!(
                "--aov lights: the scene has {} lights, and at most {MOST_LIGHTS} get a layer each; put them in groups \
                 (\"string group\") and use --aov groups, or name some: NAME=L'#0'.*E",
                origins.as_slice().len()
            )),
            Self::Lights => {
                (0..origins.as_slice().len()).map(|i| layer(format!("light{i}"), &format!("L'#{i}'.*E"))).collect()
            }
            Self::Groups => {
                let groups = origins.groups();
                if groups.is_empty() {
                    return refuse(
                        "--aov groups: no light of this scene is in a group; give lights a \"string group\", or use \
                         --aov lights"
                            .into(),
                    );
                }
                let ungrouped = origins.as_slice().iter().any(|o| o.group.is_none()).then_some(UNGROUPED);
                let one = |group: &str| {
                    check_name(group).map_err(|_| {
                        Error::Settings(format!(
                            "--aov groups: \"{group}\" is no name for a layer; use letters, digits, \"_\", \"-\", \".\""
                        ))
                    })?;
                    layer(format!("group.{group}"), &format!("L'{group}'.*E"))
                };
                groups.into_iter().chain(ungrouped).map(one).collect()
            }
            Self::Techniques => ["hit", "sampled"].map(|t| layer(t, &format!("L.*E @{t}"))).into_iter().collect(),
            Self::GlobalIllumination => {
                [("direct", "L[^S]?S*E"), ("caustics", "LS+[^S]S*E"), ("interreflections", "LS*[^S]S*[^S].*E")]
                    .map(|(name, expression)| layer(name, expression))
                    .into_iter()
                    .collect()
            }
        }
    }
}

/// Declares the layers in the scene and compiles them; `None` when none are asked for.
pub(crate) fn declare(aovs: &[Aov], scene: &mut Scene, options: &CompileOptions) -> Result<Option<PathLayers>, Error> {
    if aovs.is_empty() {
        return Ok(None);
    }
    let mut layers = Vec::new();
    for aov in aovs {
        layers.extend(aov.layers(scene)?);
    }
    let mut names: BTreeSet<String> = ["R", "G", "B"].map(String::from).into_iter().collect();
    names.extend(scene.layers.layers().iter().flat_map(Layer::channel_names));
    for l in &layers {
        if !names.insert(format!("{}.R", l.name)) {
            return Err(Error::Settings(format!("--aov: two layers are called \"{}\"; rename one", l.name)));
        }
    }
    check_memory(scene, layers.len(), options)?;
    let compiled = PathLayers::new(layers, scene).map_err(|why| Error::Settings(format!("--aov: {why}")))?;
    scene.layers.declare_paths(compiled.film_layers());
    Ok(Some(compiled))
}

/// Complains of films that are too large for the memory they may take, before anything is reserved.
fn check_memory(scene: &Scene, layers: usize, options: &CompileOptions) -> Result<(), Error> {
    let bytes = film_bytes(scene, layers, options.splats);
    let limit = options.max_film_bytes;
    if bytes <= limit {
        return Ok(());
    }
    let gib = |bytes: u64| bytes as f64 / (1u64 << 30) as f64;
    Err(Error::Settings(format!(
        "--aov: a film of {} x {} pixels with {layers} layers takes {:.1} GiB of memory; {:.1} are allowed: ask for fewer \
         layers, a smaller picture (--resolution) or a part of it (--crop), or allow more (--max-film-memory)",
        scene.bounds().width(),
        scene.bounds().height(),
        gib(bytes),
        gib(limit)
    )))
}
