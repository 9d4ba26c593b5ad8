//! Words that matter, as they are printed: `words/*.trycmd`, one file a subject. Run from the crate's folder.

#[test]
fn words_are_as_written() {
    trycmd::TestCases::new().case("tests/words/*.trycmd");
}
