//! Which peers there are, how they are installed and how they are started.

use crate::Setting;
use crate::contestant::{Contestant, Driver, Irradiant};
use std::path::{Path, PathBuf};
use std::process::Command;

/// A peer that comes from a package.
pub struct Peer {
    /// Folder of its virtual environment below `--peers`.
    pub folder: &'static str,
    /// What `pip install` is told.
    pub packages: &'static [&'static str],
    /// What Debian must have.
    pub debian: &'static [&'static str],
}

/// Everything that `install` installs, pinned.
pub const PEERS: [Peer; 4] = [
    Peer { folder: "mitsuba", packages: &["mitsuba==3.9.1", "numpy==2.4.6"], debian: &["libllvm19"] },
    Peer {
        folder: "cycles",
        packages: &["bpy==5.0.1", "numpy==1.26.4"],
        debian: &[
            "libxxf86vm1",
            "libxi6",
            "libxfixes3",
            "libxrender1",
            "libsm6",
            "libxkbcommon0",
            "libegl1",
            "libgomp1",
        ],
    },
    Peer { folder: "luxcore", packages: &["pyluxcore==2.11.2", "numpy==2.4.6"], debian: &[] },
    Peer { folder: "embree", packages: &["embreex==4.4.0.post1", "numpy==2.4.6"], debian: &["libembree3-3"] },
];

/// Installs what is missing into `folder`; says what failed and goes on, and fails at the end if something did. Debian's packages
/// need root and are only named.
pub fn install(folder: &Path, python: &str) -> Result<(), String> {
    let mut failed = Vec::new();
    for peer in &PEERS {
        let home = folder.join(peer.folder);
        let pip = home.join("bin/pip");
        let made =
            pip.exists() || Command::new(python).args(["-m", "venv"]).arg(&home).status().is_ok_and(|s| s.success());
        let installed = made
            && Command::new(&pip).args(["install", "--quiet"]).args(peer.packages).status().is_ok_and(|s| s.success());
        if !installed {
            failed.push(peer.folder);
        }
        let result = if installed { "installed" } else { "FAILED" };
        println!("{result}: {} into {}", peer.packages.join(" "), home.display());
        if !peer.debian.is_empty() {
            println!("  it needs Debian's {}", peer.debian.join(" "));
        }
    }
    if failed.is_empty() { Ok(()) } else { Err(format!("not installed: {}", failed.join(", "))) }
}

/// Irradiant on the scene of a folder.
pub fn irradiant(setting: &Setting, folder: &Path, extra: &[&str]) -> Irradiant {
    Irradiant::new(&setting.irradiant, &folder.join("scene.pbrt"), setting.threads, extra)
}

/// Peers whose pictures take too long to be asked more than twice.
pub fn is_slow(name: &str) -> bool {
    ["Mitsuba scalar", "Cycles", "LuxCore"].contains(&name)
}

/// LLVM's library for Dr.Jit: what the environment says, or the newest that Debian knows.
fn llvm() -> Option<PathBuf> {
    if let Some(said) = std::env::var_os("DRJIT_LIBLLVM_PATH") {
        return Some(said.into());
    }
    let folders = ["/usr/lib/x86_64-linux-gnu", "/usr/lib/aarch64-linux-gnu", "/usr/lib64", "/usr/lib"];
    let names = folders.iter().filter_map(|f| std::fs::read_dir(f).ok()).flatten().flatten().map(|e| e.path());
    // 15 and 16 abort on processors with AVX-512.
    let version = |p: &PathBuf| {
        let name = p.file_name()?.to_string_lossy().into_owned();
        let number = name.strip_prefix("libLLVM.so.").or_else(|| name.strip_prefix("libLLVM-"))?;
        number.split('.').next()?.parse::<u32>().ok().filter(|v| *v >= 17)
    };
    names.filter(|p| version(p).is_some()).max_by_key(|p| version(p))
}

/// Renderers with their names.
pub type Contestants = Vec<(String, Box<dyn Contestant>)>;

/// Everybody who can render the scene of a folder, ours first, and who cannot and why.
pub fn all(setting: &Setting, folder: &Path) -> (Contestants, Vec<String>) {
    let mut contestants: Contestants = Vec::new();
    let mut missing = Vec::new();
    let ours: [(&str, &[&str]); 4] = [
        ("rgb", &["--color", "rgb"]),
        // One light sample at each surface, as Mitsuba's `path` takes: for raw paths per second.
        ("one light", &["--color", "rgb", "--estimator", "candidates=1"]),
        ("shared", &["--color", "rgb", "--integrator", "sharedpath"]),
        ("spectral", &["--color", "spectral"]),
    ];
    for (name, options) in ours {
        contestants.push((format!("Irradiant {name}"), Box::new(irradiant(setting, folder, options))));
    }
    let Some(peers) = &setting.peers else {
        return (contestants, vec!["all peers: no --peers folder".into()]);
    };
    let wanted = |name: &str| {
        let name = name.to_lowercase();
        setting.only.is_empty() || setting.only.iter().any(|o| name.contains(&o.to_lowercase()))
    };
    let llvm = llvm();
    if llvm.is_none() && wanted("Mitsuba llvm") {
        missing.push("Mitsuba llvm: no libLLVM of version 17 or newer".into());
    }
    let scripts = setting.repository.join("bench/peers");
    let mut start = |name: &str, home: &str, script: &str, extra: &[&str], environment: &[(String, String)]| {
        if !wanted(name) {
            return;
        }
        let python = peers.join(home).join("bin/python");
        let threads = setting.threads.to_string();
        let mut arguments = vec![folder.to_string_lossy().into_owned(), threads];
        arguments.extend(extra.iter().map(ToString::to_string));
        let log = folder.join(format!("{}.log", name.replace(' ', "-")));
        match Driver::start(&python, &scripts.join(script), &arguments, environment, &log) {
            Ok(driver) => contestants.push((name.into(), Box::new(driver))),
            Err(why) => missing.push(format!("{name}: {why}")),
        }
    };
    if let Some(library) = llvm {
        let environment = [("DRJIT_LIBLLVM_PATH".to_string(), library.to_string_lossy().into_owned())];
        start("Mitsuba llvm", "mitsuba", "mitsuba_peer.py", &["llvm_ad_rgb", "independent"], &environment);
        start("Mitsuba llvm mj", "mitsuba", "mitsuba_peer.py", &["llvm_ad_rgb", "multijitter"], &environment);
    }
    start("Mitsuba scalar", "mitsuba", "mitsuba_peer.py", &["scalar_rgb", "independent"], &[]);
    start("Cycles", "cycles", "cycles_peer.py", &[], &[]);
    start("LuxCore", "luxcore", "luxcore_peer.py", &[], &[]);
    (contestants, missing)
}
