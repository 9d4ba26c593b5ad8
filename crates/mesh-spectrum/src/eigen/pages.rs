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

/// Asks the system to put entries from `offset` on, which start a large page, into such pages. A hint, which may do nothing.
#[cfg(target_os = "linux")]
pub(crate) fn advise(memory: &[f64], offset: usize) {
    let Some(entries) = memory.get(offset..) else { return };
    let bytes = size_of_val(entries) / PAGE * PAGE;
    // SAFETY: the range is whole pages inside memory that is borrowed here, and MADV_HUGEPAGE changes neither what is in
    // it nor who may use it.
    let _ = unsafe { libc::madvise(entries.as_ptr().cast_mut().cast(), bytes, libc::MADV_HUGEPAGE) };
}

#[cfg(not(target_os = "linux"))]
pub(crate) fn advise(_: &[f64], _: usize) {}

/// Bytes of an ordinary page, where that is what the system has; elsewhere the call below fails and does nothing.
const ORDINARY: usize = 4096;

/// Asks the system for the pages of memory that is about to be written to, all at once. A hint, which may do nothing.
#[cfg(target_os = "linux")]
pub(crate) fn touch(rows: &mut [Row]) {
    let entries = rows.as_flattened_mut();
    let before = entries.as_ptr().align_offset(ORDINARY).min(entries.len());
    let whole = &mut entries[before..];
    let length = size_of_val(whole) / ORDINARY * ORDINARY;
    if length > 0 {
        // SAFETY: the range is whole pages inside memory that is borrowed mutably here, and MADV_POPULATE_WRITE changes
        // nothing that is in it.
        let _ = unsafe { libc::madvise(whole.as_mut_ptr().cast(), length, libc::MADV_POPULATE_WRITE) };
    }
}

#[cfg(not(target_os = "linux"))]
pub(crate) fn touch(_: &mut [Row]) {}
