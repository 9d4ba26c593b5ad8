//! Large pages for memory that is gone through again and again, and pages that are taken many at a time.
//!
//! A processor keeps the addresses of some thousand pages at hand. Factors of large meshes take more pages of 4 KiB than
//! that. (Blocks do not gain by large pages: they are gone through from one end to the other, and in virtual machines
//! memory in large pages is often dear to touch for the first time.)
//!
//! The system gives a page when it is touched for the first time, which interrupts the program: a tenth of the time on a
//! mesh of 9,000 vertices. Asked for the pages of a whole block at once, it takes two thirds of that.

use crate::eigen::block::Row;

/// Bytes of a large page.
const PAGE: usize = 2 << 20;

/// Memory of less than this many bytes is left alone: to fill a large page for the first time is dear.
const WORTH: usize = 4 << 20;

/// Bytes of a large page if memory of so many bytes is worth it, 0 otherwise.
pub(crate) fn large(bytes: usize) -> usize {
    if cfg!(target_os = "linux") && bytes >= WORTH { PAGE } else { 0 }
}

/// Bytes of an ordinary page, where that is what the system has; elsewhere asking for them fails and does nothing.
const ORDINARY: usize = 4096;

/// Asks the system to put entries from `offset` on, which start a large page, into such pages. A hint, which may do nothing.
pub(crate) fn advise(memory: &[f64], offset: usize) {
    #[cfg(target_os = "linux")]
    tell(memory.get(offset..).unwrap_or_default(), PAGE, libc::MADV_HUGEPAGE);
    #[cfg(not(target_os = "linux"))]
    let _ = (memory, offset, PAGE);
}

/// Asks the system for the pages of memory that is about to be written to, all at once. A hint, which may do nothing.
pub(crate) fn touch(rows: &mut [Row]) {
    #[cfg(target_os = "linux")]
    tell(rows.as_flattened(), ORDINARY, libc::MADV_POPULATE_WRITE);
    #[cfg(not(target_os = "linux"))]
    let _ = (rows, ORDINARY);
}

/// Gives the system advice about the whole pages of so many bytes in a piece of memory.
#[cfg(target_os = "linux")]
fn tell(memory: &[f64], page: usize, advice: libc::c_int) {
    let whole = &memory[memory.as_ptr().align_offset(page).min(memory.len())..];
    let bytes = size_of_val(whole) / page * page;
    if bytes > 0 {
        // SAFETY: the range is whole pages inside memory that is borrowed here, and neither MADV_HUGEPAGE nor
        // MADV_POPULATE_WRITE, the two that are given, changes what is in it or who may use it.
        let _ = unsafe { libc::madvise(whole.as_ptr().cast_mut().cast(), bytes, advice) };
    }
}
