# Recipes of the house. `just check` is what CI runs; `.ci/run` installs what it needs.

export PATH := justfile_directory() / "target/python/bin" + ":" + env("PATH")

study := "target/hat-section"

# this list
default:
    @just --list --unsorted

# everything that must be green
check: fmt spelling clippy doc test-all example deny

# formatting
fmt:
    cargo fmt --all --check

# spelling, in code and text
spelling:
    typos

# lints, warnings denied
clippy:
    cargo clippy --workspace --all-targets -- -D warnings

# the crates' documentation, warnings denied
doc:
    RUSTDOCFLAGS="-D warnings" cargo doc --workspace --no-deps

# the tests; those that need Python packages or Chromium skip, with a word, where these are missing
test:
    cargo test --workspace

# the same command, with nothing allowed to skip
test-all:
    CRUMPLE_TESTS_MUST_RUN=1 cargo test --workspace

# the example from its files to the report
example:
    rm -rf {{ study }}
    cargo run --release -- analyze examples/hat-section/runs --params examples/hat-section/inputs.csv --join 2.5 -o {{ study }}
    test -s {{ study }}/report.html

# the tables and pictures of docs/experiment.md, in a few minutes; without ../shared those of the fine bundle are left out
experiment:
    cargo build --release -p crumple-cli -p structures
    python3 benches/experiment --write docs/experiment.md

# the tables of docs/joining.md: sheets apart, joined by distance, by the deck's welds, and with their nodes merged
joining:
    cargo build --release
    rm -rf target/joining
    python3 benches/joining.py target/release/crumple target/joining

# the tables of docs/rotation-spectrum.md; without ../shared those of the fine bundle are left out
rotation:
    cargo build --release -p crumple-cli -p structures
    python3 benches/rotation_spectrum --write docs/rotation-spectrum.md

# licences, forbidden crates and sources of Cargo.lock; without network
deny:
    cargo deny check licenses bans sources

# known vulnerabilities and yanked crates; needs network
advisories:
    cargo deny check advisories

# `crumple analyze` beside lasso-python + SciPy + scikit-learn on one bundle, alternating
bench-analyze bundle="examples/hat-section/runs" repeats="3":
    cargo build --release
    python3 benches/side_by_side.py {{ bundle }} --repeats {{ repeats }} --scratch target/side-by-side

# our reader beside plain reads and lasso-python on a family of 400 MB, and opening 1,000 files
bench-read repeats="3":
    cargo build --release -p d3plot --example read_speed
    python3 benches/read_peers.py target/release/examples/read_speed --scratch target/bench-read --repeats {{ repeats }}

# projecting a bundle beside reading its files alone, and beside lasso-python + NumPy doing the same: the example, whose
# files hold little beside positions, and runs with all that a solver writes
bench-projection repeats="3":
    cargo build --release
    cargo build --release -p d3plot --example read_speed
    target/release/examples/read_speed bundle target/bench-projection
    python3 benches/projection.py examples/hat-section/runs --repeats {{ repeats }}
    python3 benches/projection.py target/bench-projection --repeats {{ repeats }} --join ""

# a search of a million descriptors of 51 numbers beside plain reading from memory; 4 GB below target/
bench-search folder="target/bench-search":
    cargo build --release -p crumple --example search_speed
    test -d {{ folder }}/study || target/release/examples/search_speed make {{ folder }}
    target/release/examples/search_speed time {{ folder }}

# the table of docs/reading.md: every test family read by us, lasso-python, VTK and dynars (the last: pip install dynars)
read-table:
    cargo build --release
    python3 benches/read_table.py target/release/crumple crates/d3plot/testdata ../shared/data/d3plot --write docs/reading.md

# fuzz the readers of result files and of decks, `seconds` for each target; needs a nightly toolchain and cargo-fuzz
fuzz seconds="300":
    for target in family header geometry state; do \
        mkdir -p target/fuzz-corpus/$target && \
        cargo +nightly fuzz run --fuzz-dir fuzz -s none $target target/fuzz-corpus/$target fuzz/corpus/$target -- \
            -max_total_time={{ seconds }} -max_len=60000 -timeout=10 -rss_limit_mb=2048 || exit 1; \
    done
    mkdir -p target/fuzz-corpus/deck
    cargo +nightly fuzz run --fuzz-dir crates/keyword-deck/fuzz -s none deck target/fuzz-corpus/deck crates/keyword-deck/fuzz/corpus/deck -- \
        -max_total_time={{ seconds }} -max_len=4096 -timeout=10 -rss_limit_mb=512

# the eigenbasis beside SciPy + CHOLMOD, LaPy, SLEPc and dense `eigh`; needs libsuitesparse-dev, python3-slepc4py and python3-scipy (Debian)
bench-eigen *options:
    cargo build --release -p mesh-spectrum --example measure
    cargo build --release -p crumple
    test -x target/bench-eigen/venv/bin/python || python3 -m venv target/bench-eigen/venv
    target/bench-eigen/venv/bin/pip install --quiet --requirement benches/eigen/requirements.txt
    target/bench-eigen/venv/bin/python benches/eigen/run.py --page docs/eigen.md {{ options }}

# how time and memory of the eigenbasis grow with N and K: the second table of docs/eigen.md and its picture
bench-growth *options:
    cargo build --release -p mesh-spectrum --example measure
    python3 benches/eigen/growth.py {{ options }}

# fetch and bundle the report's JavaScript anew
vendor:
    crates/crumple/src/report/page/vendor/make.sh
