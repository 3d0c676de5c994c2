//! The page of results, made from the data beside it and from nothing else.

use crate::machine::Machine;
use crate::picture::BLOCK;
use crate::pictures::{Entry, Report};
use crate::plot::{Series, chart};
use crate::{growth, rays, scene, street};
use serde::de::DeserializeOwned;
use std::fmt::Write;
use std::path::Path;

fn read<T: DeserializeOwned>(folder: &Path, name: &str) -> Result<Option<T>, String> {
    let path = folder.join(name);
    let Ok(text) = std::fs::read_to_string(&path) else { return Ok(None) };
    serde_json::from_str(&text).map(Some).map_err(|e| format!("{}: {e}", path.display()))
}

fn geometric_mean(values: impl IntoIterator<Item = f64>) -> f64 {
    let logs: Vec<f64> = values.into_iter().map(f64::ln).collect();
    (logs.iter().sum::<f64>() / logs.len() as f64).exp()
}

/// "met", or by what it was missed.
fn verdict(found: f64, goal: f64) -> String {
    if found <= goal { "met".into() } else { format!("**missed by a factor of {:.2}**", found / goal) }
}

fn where_measured(m: &Machine) -> String {
    format!(
        "{}, {} logical processors, {}; {}; {}; commit `{}`, {}, load average before: {:.1}{}.\n\n",
        m.processor,
        m.cores,
        m.vectors.join(" "),
        m.system,
        m.compiler,
        m.commit,
        m.date,
        m.load,
        if m.load > 1.0 { " (**the machine was busy with other work**: trust ratios, not seconds)" } else { "" }
    )
}

fn missing(list: &[String]) -> String {
    if list.is_empty() { String::new() } else { format!("Left out: {}.\n\n", list.join("; ")) }
}

fn libraries(embrees: &[String]) -> String {
    if embrees.is_empty() { String::new() } else { format!("Libraries: {}.\n\n", embrees.join(", ")) }
}

fn product(e: Option<&Entry>) -> f64 {
    e.map_or(f64::NAN, Entry::product)
}

/// The peer with the least error times time.
fn best_peer(r: &Report) -> Option<&Entry> {
    let peers = r.entries.iter().filter(|e| !e.ours && e.product().is_finite() && e.product() > 0.0);
    peers.min_by(|a, b| a.product().total_cmp(&b.product()))
}

/// A number, or a dash for what was not measured.
fn figure(x: f64, digits: usize) -> String {
    if x.is_finite() { format!("{x:.digits$}") } else { "-".into() }
}

fn picture_tables(reports: &[Report]) -> String {
    let mut out = String::from("## Pictures: error x CPU time\n\n");
    out += "relMSE = mean over pixels and channels of (x - r)^2 / (r^2 + 0.01 mean(r)^2), nothing trimmed, pixels that see a lamp or the sky left out, \
            box filter, equal depth. Error x time: lower is better. Goal: at most 0.5 x the best peer's, for 1,000 lamps at most 0.1 x Mitsuba's; \
            paths per CPU second at least Mitsuba's, which takes one light sample at each surface, as ours do with `candidates=1`; by itself `path` chooses \
            among several at the first two.\n\n";
    out += "| scene | `path`, rgb | `sharedpath`, rgb | `path`, spectral | best peer | `path` / best | `sharedpath` / best | goal | by `path` | by `sharedpath` | paths per CPU s, of Mitsuba llvm's: `candidates=1` | the same: `path` |\n|---|---|---|---|---|---|---|---|---|---|---|---|\n";
    for r in reports {
        let find = |name: &str| r.entries.iter().find(|e| e.name == name);
        let [rgb, shared, spectral] =
            ["Irradiant rgb", "Irradiant shared", "Irradiant spectral"].map(|name| product(find(name)));
        let (best, plain) = (best_peer(r), find("Mitsuba llvm"));
        let (rival, goal) = if r.scene == "lamps" { (plain, 0.1) } else { (best, 0.5) };
        let name = rival.map_or("none", |b| &b.name);
        let speed = |name: &str| plain.zip(find(name)).map_or(f64::NAN, |(m, o)| m.cost() / o.cost());
        let speeds = ["Irradiant one light", "Irradiant rgb"].map(|name| figure(speed(name), 2)).join(" | ");
        let rival = product(rival);
        let _ = writeln!(
            out,
            "| {} | {rgb:.4} | {} | {spectral:.4} | {rival:.4} ({name}) | {:.2} | {} | {goal} | {} | {} | {speeds} |",
            r.scene,
            figure(shared, 4),
            rgb / rival,
            figure(shared / rival, 2),
            verdict(rgb / rival, goal),
            verdict(shared / rival, goal)
        );
    }
    let _ = writeln!(
        out,
        "\n`sharedpath` shares indirect light and that of the sky among the pixels of 4 by 4 blocks: their errors go together, so that less is gained where one looks at more than \
         single pixels. The same measure, of means over {BLOCK} by {BLOCK} pixels:\n\n| scene | `path` / best | `sharedpath` / best | best peer by this |\n|---|---|---|---|"
    );
    for r in reports {
        let of = |name: &str| r.entries.iter().find(|e| e.name == name).map_or(f64::NAN, Entry::block_product);
        let peers = r.entries.iter().filter(|e| !e.ours && e.name != "LuxCore" && e.block_product() > 0.0);
        let Some(best) = peers.min_by(|a, b| a.block_product().total_cmp(&b.block_product())) else { continue };
        let rival = best.block_product();
        let _ = writeln!(
            out,
            "| {} | {} | {} | {} |",
            r.scene,
            figure(of("Irradiant rgb") / rival, 2),
            figure(of("Irradiant shared") / rival, 2),
            best.name
        );
    }
    out += "\nSpectral, and LuxCore: error from the scatter between seeds, because the colours of the one and the glossy metal of the other are not those of the \
         reference.\n\n";
    for r in reports {
        let _ = writeln!(
            out,
            "### {}\n\n{} x {} pixels, {} triangles, {} thread(s), {:.1} % of the pixels left out. References: {}, {} samples per pixel each, ratio of \
             their means {:.4} {:.4} {:.4}, relMSE to each other {:.2e}; the error is estimated with both, so that their noise cancels.\n",
            r.scene,
            r.resolution[0],
            r.resolution[1],
            r.triangles,
            r.threads,
            r.masked_percent,
            r.references,
            r.reference_spp,
            r.reference_ratio[0],
            r.reference_ratio[1],
            r.reference_ratio[2],
            r.reference_apart
        );
        out += &where_measured(&r.machine);
        out += &missing(&r.missing);
        out += "| renderer | spp | pictures | relMSE | relMSE from scatter | CPU s | Mpaths per CPU s | error x time | uncertainty | mean / reference | load | memory, MB | version |\n\
                |---|---|---|---|---|---|---|---|---|---|---|---|---|\n";
        for e in &r.entries {
            let rate = f64::from(r.resolution[0] * r.resolution[1]) * f64::from(e.spp) / e.cost() / 1e6;
            let _ = writeln!(
                out,
                "| {} | {} | {} | {:.5} | {} | {:.2} | {rate:.3} | {:.4} | {} | {:.4} | {:.1} | {:.0} | {} |",
                e.name,
                e.spp,
                e.errors.len(),
                e.errors.iter().sum::<f64>() / e.errors.len() as f64,
                e.scatter.map_or("-".into(), |s| format!("{s:.5}")),
                e.cost(),
                e.product(),
                if e.errors.len() > 1 { format!("{:.0} %", 100.0 * e.uncertainty()) } else { "-".into() },
                e.mean_ratio.iter().sum::<f64>() / 3.0,
                e.loads.iter().sum::<f64>() / e.loads.len() as f64,
                e.peak_memory_bytes as f64 / 1e6,
                e.version
            );
        }
        out += "\n";
    }
    out
}

fn street_section(r: &street::Report, folder: &Path) -> Result<String, String> {
    let mut out = String::from("## The street\n\n");
    let _ = writeln!(
        out,
        "{} triangles, {} x {} pixels, 2 bounces, under a sunny sky; {:.0} % of the pixels see the sky. The lecture's took 18 minutes on two 800 MHz processors \
         at 16 paths per pixel. References: {}, {} samples per pixel each, ratio of means {:.4} {:.4} {:.4}.\n",
        r.triangles,
        r.resolution[0],
        r.resolution[1],
        r.masked_percent,
        r.references,
        r.reference_spp,
        r.reference_ratio[0],
        r.reference_ratio[1],
        r.reference_ratio[2]
    );
    out += &where_measured(&r.machine);
    out += &missing(&r.missing);
    out += "| renderer | spp | pictures | relMSE | CPU s | Mpaths per CPU s | load | version |\n|---|---|---|---|---|---|---|---|\n";
    let pixels = f64::from(r.resolution[0] * r.resolution[1]);
    for p in &r.points {
        let rate = pixels * f64::from(p.spp) / p.cpu_seconds / 1e6;
        let _ = writeln!(
            out,
            "| {} | {} | {} | {:.5}{} | {:.2} | {rate:.3} | {:.1} | {} |",
            p.name,
            p.spp,
            p.pictures,
            p.error,
            p.uncertainty.map_or(String::new(), |u| format!(" +- {u:.5}")),
            p.cpu_seconds,
            p.load,
            p.version
        );
    }
    let at16 = r.points.iter().find(|p| p.name == "Irradiant rgb" && p.spp == 16).map_or(f64::NAN, |p| p.cpu_seconds);
    let judged = |found: f64, goal: f64| match r.resolution {
        [1536, 654] => format!("goal {goal}: {}", verdict(found, goal)),
        _ => "a smaller picture than that of the goal".into(),
    };
    let _ = writeln!(out, "\n16 paths per pixel: {at16:.1} CPU s; {}.", judged(at16, 12.0));
    if let Some(two) = &r.on_two {
        let (seconds, verdict) = (two.seconds, judged(two.seconds, 6.0));
        let _ = writeln!(
            out,
            "On {} threads: {seconds:.1} s on the wall ({:.1} CPU s, load before {:.1}); {verdict}; {:.0} times the paths per second of the lecture's machine.",
            two.threads,
            two.cpu_seconds,
            two.load,
            18.0 * 60.0 / seconds
        );
    }
    let curves = [
        ("path", r.equal_error_spp, r.equal_error_cpu_seconds),
        ("sharedpath", r.shared_equal_error_spp, r.shared_equal_error_cpu_seconds),
    ];
    let _ = writeln!(out, "\nThe error of 16 independent samples of `path` ({:.5}):\n", r.independent_error);
    for (name, spp, cpu) in curves {
        let _ = match spp.zip(cpu) {
            Some((spp, cpu)) => {
                writeln!(out, "- by `{name}` with {spp:.1} samples in {cpu:.1} CPU s; {}.", judged(cpu, 4.0))
            }
            None => writeln!(out, "- by `{name}`: outside of the measured curve."),
        };
    }
    let series = |name: &str| -> Series {
        let own = r.points.iter().filter(|p| p.name == name);
        (name.to_string(), own.map(|p| (p.cpu_seconds, p.error)).collect())
    };
    let names = ["Irradiant rgb", "Irradiant shared", "Irradiant independent", "Irradiant spectral", "Mitsuba llvm"];
    let all: Vec<Series> = names.map(series).into_iter().filter(|(_, p)| !p.is_empty()).collect();
    save(folder, "street.svg", &chart("The street: error by CPU time", "CPU seconds", "relMSE", &all))?;
    out += "\n![error by time](street.svg)\n\n";
    if folder.join("street.jpg").exists() {
        out += "![the street, 16 paths per pixel, half size](street.jpg)\n\n";
    }
    Ok(out)
}

fn ray_section(r: &rays::Report) -> String {
    let mut out = String::from("## Rays\n\n");
    out += &where_measured(&r.machine);
    out += &missing(&r.missing);
    out += &libraries(&r.embrees);
    let _ = writeln!(
        out,
        "Million rays per CPU second, the best of {} interleaved passes; the same rays for all, Embree at medium quality. \"x16\" are Embree's packets (for coherent rays with its hint, too), \"batch\" are ours of 256. Goal: single rays at least 1.15 x Embree 4's (geometric mean), none below 1.0; batches level with its packets.\n",
        r.passes
    );
    let scenes: Vec<&str> = dedup(r.rates.iter().map(|x| x.scene.as_str()));
    let kinds: Vec<&str> = dedup(r.rates.iter().map(|x| x.kind.as_str()));
    let tracers: Vec<&str> = dedup(r.rates.iter().map(|x| x.tracer.as_str()));
    let rate = |scene: &str, kind: &str, tracer: &str, threads: usize| {
        let found =
            r.rates.iter().find(|x| x.scene == scene && x.kind == kind && x.tracer == tracer && x.threads == threads);
        found.map(|x| x.best)
    };
    // Packets with or without the hint, whatever is better.
    let best = |scene: &str, kind: &str, tracer: &str, threads: usize| {
        let hint = rate(scene, kind, &format!("{tracer} hint"), threads).unwrap_or(0.0);
        rate(scene, kind, tracer, threads).map_or(f64::NAN, |r| r.max(hint))
    };
    for threads in [1, 2] {
        let _ = writeln!(
            out,
            "### {threads} thread(s)\n\n| scene | rays | {} |\n|---|---|{}",
            tracers.join(" | "),
            "---|".repeat(tracers.len())
        );
        for scene in &scenes {
            for kind in &kinds {
                let cells: Vec<String> = tracers
                    .iter()
                    .map(|t| rate(scene, kind, t, threads).map_or("-".into(), |r| format!("{r:.2}")))
                    .collect();
                let _ = writeln!(out, "| {scene} | {kind} | {} |", cells.join(" | "));
            }
        }
        out += "\n";
    }
    let pairs: Vec<(&str, &str)> = scenes.iter().flat_map(|s| kinds.iter().map(move |k| (*s, *k))).collect();
    for (ours, theirs, goal) in [
        ("Irradiant", "Embree 4", Some(1.15)),
        ("Irradiant", "Embree 4 robust", None),
        ("Irradiant", "Embree 3", None),
        ("Irradiant batch", "Embree 4 x16", Some(1.0)),
    ] {
        if !tracers.contains(&theirs) {
            continue;
        }
        let ratios: Vec<f64> = pairs.iter().map(|(s, k)| best(s, k, ours, 1) / best(s, k, theirs, 1)).collect();
        let lowest = ratios.iter().copied().fold(f64::INFINITY, f64::min);
        let mean = geometric_mean(ratios.iter().copied());
        let judged = goal.map_or(String::new(), |g| format!("; goal {g}: {}", verdict(g, mean)));
        let _ = writeln!(out, "- {ours} / {theirs}, one thread: geometric mean {mean:.2}, lowest {lowest:.2}{judged}.");
    }
    let mut odd = Vec::new();
    for (scene, kind) in &pairs {
        let own = r.rates.iter().filter(|x| x.scene == *scene && x.kind == *kind && x.threads == 1 && x.different > 0);
        if let Some(worst) = own.clone().max_by_key(|x| x.different) {
            odd.push(format!(
                "{scene}, {kind}: {} tracers, at most {} of {} rays",
                own.count(),
                worst.different,
                worst.rays
            ));
        }
    }
    let odd = if odd.is_empty() { "none".into() } else { odd.join("; ") };
    let _ =
        writeln!(out, "- Answers that differ from ours in hit or miss, or by more than 1e-4 of the distance: {odd}.\n");
    out + &build_section(r, &scenes)
}

fn build_section(r: &rays::Report, scenes: &[&str]) -> String {
    let mut out = String::from("### Builds\n\n");
    if r.builds.iter().any(|b| b.helped_seconds.is_none()) {
        return out
            + "Not shown: what was measured does not say how many threads worked (Embree's builds on \"one thread\" were on two).\n\n";
    }
    out += "Each in a process of its own, after a small one; of as many as there are passes, by turns, the least CPU seconds and the least seconds on the wall. \
            \"By others\": CPU seconds of other threads than the one that asked.\n\n\
            | scene | triangles | tracer | threads | seconds | CPU s | by others | nodes and leaves, MB |\n|---|---|---|---|---|---|---|---|\n";
    for b in &r.builds {
        let _ = writeln!(
            out,
            "| {} | {} | {} | {} | {:.3} | {:.3} | {:.3} | {:.1} |",
            b.scene,
            b.triangles,
            b.tracer,
            b.threads,
            b.seconds,
            b.cpu_seconds,
            b.helped_seconds.unwrap_or(f64::NAN),
            b.memory_bytes as f64 / 1e6
        );
    }
    let _ = writeln!(
        out,
        "\nOurs to Embree's on as many threads; goal: at most 1.0 of its time in every scene.\n\n| Irradiant / | threads | what | {} | geometric mean | goal |\n|---|---|---|{}---|---|",
        scenes.join(" | "),
        "---|".repeat(scenes.len())
    );
    let build = |scene: &str, tracer: &str, threads: usize| {
        r.builds.iter().find(|b| b.scene == scene && b.tracer == tracer && b.threads == threads)
    };
    for theirs in ["Embree 4", "Embree 3"] {
        for threads in [1, 2] {
            let whats: [(_, fn(&rays::Build) -> f64); 2] =
                [("CPU seconds", |b| b.cpu_seconds), ("seconds on the wall", |b| b.seconds)];
            for (what, of) in whats {
                let pair = |s: &&str| build(s, "Irradiant", threads).zip(build(s, theirs, threads));
                let ratios: Vec<f64> = scenes.iter().filter_map(pair).map(|(a, b)| of(a) / of(b)).collect();
                // A scene that is missing is named above.
                if ratios.len() < scenes.len() || ratios.is_empty() {
                    continue;
                }
                let cells: Vec<String> = ratios.iter().map(|x| format!("{x:.2}")).collect();
                let worst = ratios.iter().copied().fold(0.0, f64::max);
                let _ = writeln!(
                    out,
                    "| {theirs} | {threads} | {what} | {} | {:.2} | {} |",
                    cells.join(" | "),
                    geometric_mean(ratios),
                    verdict(worst, 1.0)
                );
            }
        }
    }
    // Trees are the same for any number of threads, and one of the builds may have been left out.
    let either = |scene: &str, tracer: &str| build(scene, tracer, 1).or_else(|| build(scene, tracer, 2));
    let both: Vec<_> = scenes.iter().filter_map(|s| either(s, "Irradiant").zip(either(s, "Embree 4"))).collect();
    if !both.is_empty() {
        let memory = geometric_mean(both.iter().map(|(a, b)| a.memory_bytes as f64 / b.memory_bytes as f64));
        let _ = writeln!(
            out,
            "\nMemory, Irradiant / Embree 4, geometric mean {memory:.2}, goal 0.7: {}.",
            verdict(memory, 0.7)
        );
    }
    out + "\n"
}

fn dedup<'a>(names: impl Iterator<Item = &'a str>) -> Vec<&'a str> {
    let mut found: Vec<&str> = Vec::new();
    names.for_each(|n| {
        if !found.contains(&n) {
            found.push(n);
        }
    });
    found
}

fn growth_section(r: &growth::Report, folder: &Path) -> Result<String, String> {
    let mut out = String::from("## Growth\n\n");
    out += &where_measured(&r.machine);
    out += &missing(&r.missing);
    out += &libraries(&r.embrees);
    // Of data that do not say how many threads worked, no builds are shown: Embree's on "one thread" were on two.
    let built = |s: &growth::Size| s.helped_seconds.map_or(f64::NAN, |_| s.build_seconds);
    out += "| triangles | tracer | build, CPU s | primary, ns per ray | bounce 1, ns per ray | MB |\n|---|---|---|---|---|---|\n";
    for s in &r.sizes {
        let mb = s.memory_bytes as f64 / 1e6;
        let _ = writeln!(
            out,
            "| {} | {} | {} | {:.0} | {:.0} | {mb:.1} |",
            s.triangles,
            s.tracer,
            figure(built(s), 3),
            s.primary,
            s.bounce
        );
    }
    let tracers = dedup(r.sizes.iter().map(|s| s.tracer.as_str()));
    let line = |tracer: &str, what: &str, pick: &dyn Fn(&growth::Size) -> f64| -> Series {
        let own = r.sizes.iter().filter(|s| s.tracer == tracer);
        let points = own.map(|s| (s.triangles as f64, pick(s))).filter(|p| p.1.is_finite());
        (format!("{tracer}{what}"), points.collect())
    };
    let rays: Vec<Series> = tracers
        .iter()
        .flat_map(|t| [line(t, ", primary", &|s| s.primary), line(t, ", bounce", &|s| s.bounce)])
        .collect();
    let builds: Vec<Series> = tracers.iter().map(|t| line(t, "", &built)).collect();
    save(folder, "growth-rays.svg", &chart("One ray, by triangles", "triangles", "ns", &rays))?;
    save(
        folder,
        "growth-build.svg",
        &chart("Building, by triangles, one thread", "triangles", "CPU seconds", &builds),
    )?;
    out += "\n![time per ray](growth-rays.svg)\n![time to build](growth-build.svg)\n\n";
    out += "| lamps | renderer | CPU us per path | relMSE at 16 spp | error x time per path | read and compile, s |\n|---|---|---|---|---|---|\n";
    for l in &r.lamps {
        let load = l.load_seconds.map_or("-".into(), |s| format!("{s:.2}"));
        let _ = writeln!(
            out,
            "| {} | {} | {:.3} | {:.4} | {:.4} | {load} |",
            l.lamps,
            l.name,
            l.microseconds,
            l.error,
            l.error * l.microseconds
        );
    }
    let names = dedup(r.lamps.iter().map(|l| l.name.as_str()));
    let lamps = |what: &str, pick: fn(&growth::Lamps) -> f64| -> Vec<Series> {
        let one = |n: &&str| {
            let own = r.lamps.iter().filter(|l| l.name == *n);
            (format!("{n}{what}"), own.map(|l| (l.lamps as f64, pick(l))).collect())
        };
        names.iter().map(one).collect()
    };
    save(folder, "growth-lamps.svg", &chart("One path, by lamps", "lamps", "CPU us", &lamps("", |l| l.microseconds)))?;
    save(folder, "growth-noise.svg", &chart("Noise, by lamps, 16 spp", "lamps", "relMSE", &lamps("", |l| l.error)))?;
    out += "\n![time per path](growth-lamps.svg)\n![noise](growth-noise.svg)\n";
    Ok(out)
}

fn save(folder: &Path, name: &str, text: &str) -> Result<(), String> {
    std::fs::write(folder.join(name), text).map_err(|e| format!("{name}: {e}"))
}

/// Writes `README.md` and its charts into the folder of results.
pub fn write(folder: &Path) -> Result<(), String> {
    let mut page = String::from(
        "# Results\n\nWritten by `bench page` from the JSON files beside it; do not edit. What the experiments are and how to read them: \
         [the benchmark](../README.md).\n\n",
    );
    let mut reports = Vec::new();
    for name in scene::PICTURES {
        reports.extend(read::<Report>(folder, &format!("pictures-{name}.json"))?);
    }
    if !reports.is_empty() {
        page += &picture_tables(&reports);
    }
    if let Some(r) = read::<street::Report>(folder, "street.json")? {
        page += &street_section(&r, folder)?;
    }
    if let Some(r) = read::<rays::Report>(folder, "rays.json")? {
        page += &ray_section(&r);
    }
    if let Some(r) = read::<growth::Report>(folder, "growth.json")? {
        page += &growth_section(&r, folder)?;
    }
    save(folder, "README.md", &page)
}
