//! How much memory a computation will need, before it takes any.

use crate::eigen::EigenError;
use crate::eigen::block::WIDTH;
use crate::eigen::component::{Component, chains};

/// Columns of the spaces of one chain: the widest basis, the vectors handed over, and what an unlucky slice takes more.
const COLUMNS_A_CHAIN: usize = 440;

/// Bytes of everything at its largest, with the result: within a tenth on sheet meshes and one thread, from a fifth too few
/// to a third too many on two, whose chains need not be at their largest together.
pub(crate) fn expected(components: &[Component], dense: &[bool], count: usize, vertices: usize) -> usize {
    let area: f64 = components.iter().map(|component| component.area).sum();
    let rows: usize = components.iter().map(Component::rows).sum();
    let result = 8 * count * vertices;
    let mut kept = 0;
    let mut working: Vec<usize> = Vec::new();
    for (component, dense) in components.iter().zip(dense) {
        let n = component.rows();
        // By Weyl's law; neighbouring chains both find a few, and the last block of a chain is not full.
        let pairs = ((component.area / area * count as f64) as usize + 2).min(n);
        kept += component.bytes();
        if *dense {
            working.push(24 * n * n);
            continue;
        }
        kept += 8 * n * (pairs + 2 * WIDTH * chains(pairs));
        let chain = 8 * n * COLUMNS_A_CHAIN.min(n) + component.factor_bytes();
        working.extend((0..chains(pairs)).map(|_| chain));
    }
    // As many at a time as there are threads, the largest of them.
    working.sort_unstable_by(|a, b| b.cmp(a));
    let working: usize = working.iter().take(rayon::current_num_threads()).sum();
    // One component's vectors become the result where they are.
    if components.len() == 1 && rows == vertices { kept + working } else { kept + working.max(result) }
}

/// Refuses what does not fit.
pub(crate) fn check(needed: usize, limit: Option<usize>) -> Result<(), EigenError> {
    match limit.or_else(available) {
        Some(available) if needed > available => {
            Err(EigenError::TooLittleMemory { needed_mb: needed / 1_000_000, available_mb: available / 1_000_000 })
        }
        _ => Ok(()),
    }
}

/// Bytes that can be used without swapping, where the system says so (Linux: `MemAvailable`, and the control group).
fn available() -> Option<usize> {
    let meminfo = std::fs::read_to_string("/proc/meminfo").ok()?;
    let line = meminfo.lines().find_map(|line| line.strip_prefix("MemAvailable:"))?;
    let system = line.trim().strip_suffix("kB")?.trim().parse::<usize>().ok()?.checked_mul(1024)?;
    let number = |file: &str| std::fs::read_to_string(file).ok()?.trim().parse::<usize>().ok();
    let group = number("/sys/fs/cgroup/memory.max")
        .zip(number("/sys/fs/cgroup/memory.current"))
        .map(|(most, used)| most.saturating_sub(used));
    Some(group.map_or(system, |group| group.min(system)))
}
