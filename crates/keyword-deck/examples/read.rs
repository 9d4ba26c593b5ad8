//! Reads a deck and says how large it is and how long that took, beside plainly reading the same bytes:
//! `cargo run --release -p keyword-deck --example read -- DECK`.

use std::path::PathBuf;
use std::time::Instant;

use keyword_deck::Deck;

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let path = PathBuf::from(std::env::args_os().nth(1).ok_or("a deck is needed")?);
    let start = Instant::now();
    let bytes = std::io::copy(&mut std::fs::File::open(&path)?, &mut std::io::sink())?;
    let plain = start.elapsed().as_secs_f64();
    let start = Instant::now();
    let deck = Deck::read(&path)?;
    let seconds = start.elapsed().as_secs_f64();
    println!(
        "{} nodes, {} shells, {} solids: {:.0} MB in {seconds:.2} s, {:.0} MB/s; the bytes alone {plain:.2} s",
        deck.node_ids.len(),
        deck.shells.len(),
        deck.solids.len(),
        bytes as f64 / 1e6,
        bytes as f64 / 1e6 / seconds
    );
    if let Ok(status) = std::fs::read_to_string("/proc/self/status")
        && let Some(peak) = status.lines().find(|line| line.starts_with("VmHWM"))
    {
        println!("{peak}");
    }
    Ok(())
}
