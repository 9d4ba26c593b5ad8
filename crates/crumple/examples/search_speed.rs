//! What `just bench-search` measures: a search of a million descriptors of 51 numbers, against reading the same numbers
//! from memory and doing nothing with them but a sum.
//!
//! ```text
//! cargo run --release -p crumple --example search_speed -- make FOLDER     10,000 runs of 100 states, and a study of them
//! cargo run --release -p crumple --example search_speed -- time FOLDER     the search, alternating with plain reading
//! ```
//!
//! The runs are a plate of 126 vertices that bends and twists in 50 ways, each written once and linked 200 times: every
//! state of every run is projected and stored, only the solver's work is left out.

use std::error::Error;
use std::hint::black_box;
use std::path::Path;
use std::time::Instant;

use crumple::basis::BasisOptions;
use crumple::bundle;
use crumple::descriptor::{DescribeOptions, Threshold, describe};
use crumple::run::Run;
use crumple::select::Kind;
use crumple::similarity::{Comparer, SimilarityOptions};
use crumple::study::{AddOptions, Loaded, Rows, Study};
use crumple::target::Named;
use d3plot::{Content, Geometry, Part, Shell, WriteOptions, Writer};
use rayon::prelude::*;

const RUNS: usize = 10_000;
const STATES: usize = 100;
/// Runs that differ.
const WAYS: usize = 50;
/// Eigenpairs of the study; a descriptor of 17 reads a sixth of them.
const EIGENPAIRS: usize = 100;
/// Eigenvectors of the descriptor: 51 numbers.
const SIZE: usize = 17;
/// The most similar states that are asked for.
const TOP: usize = 20;
/// How often each thing is timed; the median counts.
const REPEATS: usize = 15;
/// Bytes read in between, so that nothing comes from a cache.
const EVICTED: usize = 1 << 30;

fn main() -> Result<(), Box<dyn Error>> {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    let [what, folder] = &arguments[..] else { return Err("search_speed make|time FOLDER".into()) };
    let folder = Path::new(folder);
    match what.as_str() {
        "make" => make(folder),
        "time" => time(folder),
        _ => Err("make or time".into()),
    }
}

fn make(folder: &Path) -> Result<(), Box<dyn Error>> {
    let (nx, ny) = (20_u32, 5_u32);
    let mut geometry = Geometry::default();
    let at = |k: u32| [5.0 * f64::from(k % (nx + 1)), 7.0 * f64::from(k / (nx + 1)), 0.0];
    geometry.coordinates = (0..(nx + 1) * (ny + 1)).map(at).collect();
    let quad = |k: u32| {
        let corner = k / nx * (nx + 1) + k % nx;
        Shell { nodes: [corner, corner + 1, corner + nx + 2, corner + nx + 1], part: 0 }
    };
    geometry.shells = (0..nx * ny).map(quad).collect();
    for run in 0..RUNS {
        let here = folder.join(format!("runs/run_{run:05}"));
        std::fs::create_dir_all(&here)?;
        if run >= WAYS {
            std::fs::hard_link(folder.join(format!("runs/run_{:05}/d3plot", run % WAYS)), here.join("d3plot"))?;
            continue;
        }
        let options = WriteOptions { title: "search speed".into(), states_in_root: true, ..WriteOptions::default() };
        let parts = [Part::new(1, "plate")];
        let mut writer = Writer::create(&here.join("d3plot"), &geometry, &parts, &Content::default(), &options)?;
        let (bend, twist) = (0.02 * (run % 10) as f64 - 0.09, 0.004 * (run / 10) as f64 - 0.008);
        for state in 0..STATES {
            let t = state as f64 / (STATES - 1) as f64;
            let place = |&[x, y, _]: &[f64; 3]| [x, y, t * (bend * x * x / 10.0 + twist * x * (y - 17.5))];
            let moved: Vec<[f64; 3]> = geometry.coordinates.iter().map(place).collect();
            let mut state = writer.state(t);
            state.coordinates(&moved)?;
            state.write()?;
        }
        writer.finish()?;
    }
    let found = bundle::find(&[folder.join("runs")])?;
    let reference = Run::open(&found[0].id, &found[0].path)?;
    let options = BasisOptions { eigenpairs: EIGENPAIRS, ..BasisOptions::default() };
    let mut study = Study::create(&folder.join("study"), &reference, &[], &[], &options, &())?;
    study.add(&found, AddOptions::default(), &())?;
    Ok(())
}

fn time(folder: &Path) -> Result<(), Box<dyn Error>> {
    let (start, before) = (Instant::now(), bytes_read());
    let loaded = Loaded::open(&folder.join("study"))?;
    println!("open the study, with mesh and basis: {:.2} s, {}", seconds(start), megabytes(before));
    let options = DescribeOptions { kind: Kind::Paper, threshold: Threshold::Top(SIZE), ..DescribeOptions::default() };
    let target = describe(&loaded, &Named::parse("run_00007"), None, Some("target"), &options)?.descriptor;
    let comparer = Comparer::new(&loaded, &target, SimilarityOptions::default())?;
    let (start, before) = (Instant::now(), bytes_read());
    let samples = comparer.features().read(&loaded.study, Rows::All)?;
    println!("read its {} numbers of every state: {:.2} s, {}", target.numbers(), seconds(start), megabytes(before));
    let parts: u64 = std::fs::read_dir(folder.join("study/coefficients"))?
        .map(|entry| Ok(entry?.metadata()?.len()))
        .sum::<std::io::Result<u64>>()?;
    println!("all coefficients of the study: {} MB", parts / 1_000_000);
    let values = &samples.blocks()[0].values;
    println!("{} descriptors, {} MB; cosine, best {TOP}", samples.rows(), 4 * values.len() / 1_000_000);
    for threads in [1, rayon::current_num_threads()] {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build()?;
        pool.install(|| {
            let other = vec![1.0_f32; EVICTED / 4];
            let (mut search, mut read) = (Vec::new(), Vec::new());
            for _ in 0..REPEATS {
                black_box(sum(&other));
                read.push(timed(|| sum(values)));
                black_box(sum(&other));
                search.push(timed(|| comparer.best(&samples, TOP).len()));
            }
            let (search, read) = (median(search), median(read));
            println!(
                "{threads} threads: read {:.1} ms ({:.1} GB/s), search {:.1} ms, ratio {:.2}",
                1e3 * read,
                4.0 * values.len() as f64 / read / 1e9,
                1e3 * search,
                search / read
            );
        });
    }
    Ok(())
}

/// Every number read once: sums in enough lanes that memory is what it waits for.
fn sum(values: &[f32]) -> f32 {
    let of = |values: &[f32]| {
        let mut lanes = [0.0_f32; 64];
        for chunk in values.as_chunks::<64>().0 {
            lanes.iter_mut().zip(chunk).for_each(|(lane, x)| *lane += x);
        }
        lanes.iter().sum::<f32>()
    };
    values.par_chunks(1 << 18).map(of).sum()
}

fn timed<T>(act: impl Fn() -> T) -> f64 {
    let start = Instant::now();
    black_box(act());
    seconds(start)
}

fn seconds(start: Instant) -> f64 {
    start.elapsed().as_secs_f64()
}

fn median(mut times: Vec<f64>) -> f64 {
    times.sort_by(f64::total_cmp);
    times[times.len() / 2]
}

/// Bytes that this process has read, where the system counts them.
fn bytes_read() -> Option<u64> {
    let counts = std::fs::read_to_string("/proc/self/io").ok()?;
    counts.lines().find_map(|line| line.strip_prefix("rchar: "))?.parse().ok()
}

fn megabytes(before: Option<u64>) -> String {
    match (before, bytes_read()) {
        (Some(before), Some(now)) => format!("{:.1} MB read", (now - before) as f64 / 1e6),
        _ => "bytes are not counted on this system".into(),
    }
}
