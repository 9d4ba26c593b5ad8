//! What `just bench-read` measures on our side; `benches/read_peers.py` runs it beside lasso-python.
//!
//! ```text
//! cargo run --release -p d3plot --example read_speed -- make FOLDER     200k shells, 12 states, 400 MB
//! cargo run --release -p d3plot --example read_speed -- many FOLDER     a family of 1,000 files
//! cargo run --release -p d3plot --example read_speed -- bundle FOLDER   20 runs of 9,025 shells, 20 states each, 600 MB
//! cargo run --release -p d3plot --example read_speed -- read FOLDER     coordinates of all states against plain reading
//! cargo run --release -p d3plot --example read_speed -- once FOLDER     opens and reads the coordinates once: for its memory
//! cargo run --release -p d3plot --example read_speed -- open FOLDER     opening against `stat` on every file
//! ```

use std::error::Error;
use std::fs::File;
use std::os::unix::fs::FileExt;
use std::path::Path;
use std::time::Instant;

use d3plot::{Content, Family, Geometry, Part, ReadOptions, Shell, Stored, WriteOptions, Writer};

/// How often each thing is timed; the median counts.
const REPEATS: usize = 15;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [what, folder] = &arguments[..] else { return Err("measure WHAT FOLDER".into()) };
    let folder = Path::new(folder);
    match what.as_str() {
        "make" => make(folder, 500, 400, 12, None),
        "many" => make(folder, 10, 10, 999, Some(1)),
        "bundle" => (1..=20).try_for_each(|run| make(&folder.join(format!("run_{run:02}")), 95, 95, 20, None)),
        "read" => read(folder),
        "once" => once(folder),
        "open" => open(folder),
        _ => Err("make, many, bundle, read, once or open".into()),
    }
}

/// A sheet of shells that bulges, with velocities, accelerations and all results of shells at three layers.
fn make(folder: &Path, nx: u32, ny: u32, states: u32, member_states: Option<usize>) -> Result<(), Box<dyn Error>> {
    let mut geometry = Geometry::default();
    let at = |k: u32| [f64::from(k % (nx + 1)), f64::from(k / (nx + 1)), 0.0];
    geometry.coordinates = (0..(nx + 1) * (ny + 1)).map(at).collect();
    let quad = |k: u32| {
        let corner = k / nx * (nx + 1) + k % nx;
        Shell { nodes: [corner, corner + 1, corner + nx + 2, corner + nx + 1], part: k % nx * 4 / nx }
    };
    geometry.shells = (0..nx * ny).map(quad).collect();
    let parts: Vec<Part> = (1..=4).map(|id| Part::new(id, &format!("strip {id}"))).collect();
    let content = Content {
        globals: 6 + 7 * 4,
        velocity: true,
        acceleration: true,
        layers: 3,
        stress: Stored::All,
        plastic_strain: Stored::All,
        resultants: true,
        thickness: true,
        ..Content::default()
    };
    std::fs::create_dir_all(folder)?;
    let options = WriteOptions { title: "measure".into(), member_states, ..WriteOptions::default() };
    let mut writer = Writer::create(&folder.join("d3plot"), &geometry, &parts, &content, &options)?;
    let strains = vec![0.01; geometry.shells.len() * 3];
    for step in 0..states {
        let height = f64::from(step);
        let bulge = |[x, y, _]: &[f64; 3]| [*x, *y, height * (x / 40.0).sin() * (y / 30.0).cos()];
        let positions: Vec<[f64; 3]> = geometry.coordinates.iter().map(bulge).collect();
        let mut state = writer.state(f64::from(step) * 0.01);
        state.coordinates(&positions)?;
        state.set("shell_plastic_strain", &strains)?;
        state.write()?;
    }
    Ok(writer.finish()?)
}

/// The coordinates of all states: by plain reads of the same bytes, and by the crate in both precisions and by maps.
fn read(folder: &Path) -> Result<(), Box<dyn Error>> {
    let family = Family::open(folder)?;
    let mapped = Family::open_with(folder, ReadOptions { map: true })?;
    let places = places(&family)?;
    let (mut bytes, mut single, mut double) = (Vec::new(), Vec::<f32>::new(), Vec::<f64>::new());
    let mut times = [const { Vec::new() }; 5];
    for _ in 0..REPEATS {
        times[0].push(seconds(|| plain(&places, &mut bytes))?);
        times[1].push(seconds(|| all(&family, &mut single))?);
        times[2].push(seconds(|| all(&family, &mut double))?);
        times[3].push(seconds(|| all(&mapped, &mut single))?);
        times[4].push(seconds(|| {
            let family = Family::open(folder)?;
            all(&family, &mut single)
        })?);
    }
    let [plain, single, double, mapped, opened] = times.map(median);
    println!(
        r#"{{"bytes": {}, "plain": {plain}, "f32": {single}, "f64": {double}, "f32_mapped": {mapped}, "open_and_f32": {opened}}}"#,
        bytes.len() * family.times().len()
    );
    Ok(())
}

fn once(folder: &Path) -> Result<(), Box<dyn Error>> {
    let start = Instant::now();
    let family = Family::open(folder)?;
    all(&family, &mut Vec::<f32>::new())?;
    println!(r#"{{"seconds": {}}}"#, start.elapsed().as_secs_f64());
    Ok(())
}

fn all<T: d3plot::Real>(family: &Family, values: &mut Vec<T>) -> Result<(), Box<dyn Error>> {
    let mut series = family.series("coordinates");
    while series.read_next(values)?.is_some() {
        std::hint::black_box(&values);
    }
    Ok(())
}

/// A file, where to begin in it, and how much to read.
type Place = (File, u64, usize);

/// The coordinates of each state, for plain reading.
fn places(family: &Family) -> Result<Vec<Place>, Box<dyn Error>> {
    let words = 1 + family.fields().iter().find(|field| field.name == "globals").map_or(0, |field| field.columns);
    let (state, nodes) = (family.header().words_per_state * 4, family.header().nodes * 12);
    let mut places = Vec::new();
    for member in family.members() {
        for index in 0..member.states as u64 {
            places.push((File::open(&member.path)?, index * state + words * 4, nodes));
        }
    }
    Ok(places)
}

/// Reads the same bytes into one buffer and does nothing with them.
fn plain(places: &[Place], bytes: &mut Vec<u8>) -> Result<(), Box<dyn Error>> {
    for (file, at, count) in places {
        bytes.resize(*count, 0);
        file.read_exact_at(bytes, *at)?;
        std::hint::black_box(&bytes);
    }
    Ok(())
}

/// Opening a family against `stat` on each of its files, and against opening each of them.
fn open(folder: &Path) -> Result<(), Box<dyn Error>> {
    let files: Vec<_> = Family::open(folder)?.members().iter().map(|member| member.path.clone()).collect();
    let mut times = [const { Vec::new() }; 2];
    for _ in 0..REPEATS {
        times[0].push(seconds(|| Ok(files.iter().try_for_each(|file| std::fs::metadata(file).map(drop))?))?);
        times[1].push(seconds(|| Ok(Family::open(folder).map(drop)?))?);
    }
    let [stat, open] = times.map(median);
    println!(r#"{{"files": {}, "stat": {stat}, "open": {open}}}"#, files.len());
    Ok(())
}

fn seconds(run: impl FnOnce() -> Result<(), Box<dyn Error>>) -> Result<f64, Box<dyn Error>> {
    let start = Instant::now();
    run()?;
    Ok(start.elapsed().as_secs_f64())
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}
