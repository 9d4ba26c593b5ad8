//! Nodes of rigid bodies that the states leave out (NDIM 8, 9): rebuilt where the file tells how, else refused by name.
//! That they are where they should be is in `agreement` (x03, x04).

mod shared;

use d3plot::{Error, Family, Keep, Warning, WriteOptions};

use shared::{Copy, testdata};

/// A family in single precision with 24 words for each of its two bodies, the last words of each of its three states.
const FAMILY: &str = "x03_rigid_nodes";
const STATES: usize = 3;
const RIGID: [usize; 4] = [0, 1, 6, 10];

/// Changes the motion of each body in each state: the state, the 24 words.
fn with_motion(copy: &Copy, mut change: impl FnMut(usize, &mut [f32; 24])) {
    let words = Family::open(&testdata().join(FAMILY)).unwrap().header().words_per_state as usize;
    let mut bytes = copy.read("d3plot01");
    for state in 0..STATES {
        for body in 0..2 {
            let at = ((state + 1) * words - 24 * (2 - body)) * 4;
            let place = &mut bytes[at..at + 96];
            let mut motion = [0.0; 24];
            motion.iter_mut().zip(place.as_chunks().0).for_each(|(value, word)| *value = f32::from_le_bytes(*word));
            change(state, &mut motion);
            place.as_chunks_mut().0.iter_mut().zip(motion).for_each(|(word, value)| *word = value.to_le_bytes());
        }
    }
    copy.write("d3plot01", &bytes);
}

fn transpose(motion: &mut [f32; 24]) {
    for (row, column) in [(0, 1), (0, 2), (1, 2)] {
        motion.swap(3 + 3 * row + column, 3 + 3 * column + row);
    }
}

fn at(row: usize, column: usize) -> usize {
    3 * row + column
}

fn open(copy: &Copy) -> Result<Family, Error> {
    Family::open(&copy.root())
}

fn refused(copy: &Copy, why: &str) {
    let error = open(copy).unwrap_err();
    assert!(matches!(error, Error::Unsupported { .. }), "{error}");
    assert!(error.to_string().contains("rigid bodies left out of the states (NDIM = 8)"), "{error}");
    assert!(error.to_string().contains(why), "{error}");
}

fn near(a: &[f64; 3], b: &[f64; 3], within: f64) -> bool {
    a.iter().zip(b).all(|(a, b)| (a - b).abs() <= within)
}

#[test]
fn rows_and_columns_are_told_by_the_spin_and_by_the_nodes_beside() {
    let whole = Family::open(&testdata().join(FAMILY)).unwrap();
    for (transposed, spinning) in [(false, true), (true, true), (false, false), (true, false)] {
        let copy = Copy::of(FAMILY);
        with_motion(&copy, |_, motion| {
            if transposed {
                transpose(motion);
            }
            if !spinning {
                motion[15..18].fill(0.0);
            }
        });
        let family = open(&copy).unwrap();
        assert_eq!(family.warnings(), [Warning::RigidNodes { count: 4, rates: spinning }]);
        for state in 0..STATES {
            assert_eq!(family.coordinates(state).unwrap(), whole.coordinates(state).unwrap());
        }
    }
}

#[test]
fn the_bodies_keep_their_shape() {
    let family = Family::open(&testdata().join(FAMILY)).unwrap();
    let distance = |positions: &[[f64; 3]], a: usize, b: usize| {
        positions[a].iter().zip(positions[b]).map(|(a, b)| (a - b).powi(2)).sum::<f64>().sqrt()
    };
    let start = &family.geometry().coordinates;
    for state in 0..STATES {
        let positions = family.coordinates(state).unwrap().unwrap();
        for (a, b) in [(0, 1), (0, 6), (1, 6)] {
            assert!((distance(&positions, a, b) - distance(start, a, b)).abs() < 1e-3, "state {state}");
        }
        assert_eq!(state == 0, RIGID.iter().all(|&node| near(&positions[node], &start[node], 1e-3)));
    }
}

#[test]
fn velocities_are_those_of_the_positions() {
    // a constant spin and a constant drift: the way in a small part of the time, on a circle
    let copy = Copy::of(FAMILY);
    let family = open(&copy).unwrap();
    let (first, velocity) = (family.coordinates(0).unwrap().unwrap(), family.velocity(0).unwrap().unwrap());
    let spins = [[0.1, 400.0, -60.0], [300.0, 0.2, 90.0]];
    let centre = |nodes: &[usize]| {
        [0, 1, 2].map(|axis| nodes.iter().map(|&node| first[node][axis]).sum::<f64>() / nodes.len() as f64)
    };
    for (body, nodes) in [&RIGID[..3], &RIGID[3..]].into_iter().enumerate() {
        let (centre, [x, y, z]) = (centre(nodes), spins[body]);
        for &node in nodes {
            let arm = [0, 1, 2].map(|axis| first[node][axis] - centre[axis]);
            let drift = [-900.0, 200.0 * body as f64, 700.0];
            let turn = [y * arm[2] - z * arm[1], z * arm[0] - x * arm[2], x * arm[1] - y * arm[0]];
            let expected = [0, 1, 2].map(|axis| drift[axis] + turn[axis]);
            assert!(near(&velocity[node], &expected, 0.05), "{:?} {expected:?}", velocity[node]);
        }
    }
}

#[test]
fn part_of_the_nodes_are_read_like_all() {
    let family = Family::open(&testdata().join(FAMILY)).unwrap();
    for part in 0..family.parts().len() {
        let nodes = family.nodes_of_part(part);
        for (state, values) in family.series("coordinates").of_part(part).enumerate() {
            let all = family.coordinates(state).unwrap().unwrap();
            let values = values.unwrap().values;
            for (row, &node) in values.rows().zip(&nodes) {
                assert_eq!(row, all[node as usize]);
            }
        }
    }
}

#[test]
fn a_copy_has_the_rebuilt_nodes() {
    for (name, velocity) in [(FAMILY, true), ("x04_rigid_nodes_road", false)] {
        let family = Family::open(&testdata().join(name)).unwrap();
        let place = tempfile::tempdir().unwrap();
        let root = place.path().join("d3plot");
        let options = WriteOptions { precision: family.header().precision, ..WriteOptions::default() };
        let copied = family.copy(&root, Keep::default(), &options, |_| true).unwrap();
        assert_eq!(copied.left_out.contains(&"velocity"), !velocity, "{name}");
        let again = Family::open(&root).unwrap();
        assert_eq!(again.warnings(), []);
        for state in 0..STATES {
            let (before, after) =
                (family.coordinates(state).unwrap().unwrap(), again.coordinates(state).unwrap().unwrap());
            assert!(before.iter().zip(&after).all(|(before, after)| near(before, after, 1e-4)), "{name}");
        }
        assert_eq!(again.velocity(1).unwrap().is_some(), velocity);
    }
}

#[test]
fn motion_that_does_not_tell_is_refused_by_name() {
    let copy = Copy::of(FAMILY);
    with_motion(&copy, |state, motion| motion[3..12].fill(0.3 * state as f32));
    refused(&copy, "matrices that are no rotations");

    let copy = Copy::of(FAMILY);
    with_motion(&copy, |_, motion| motion[7] = f32::NAN);
    refused(&copy, "matrices that are no rotations");

    // frames that start as the identity, and a spin that turns them the other way than the nodes beside them go
    let copy = Copy::of(FAMILY);
    let mut first = Vec::new();
    let mut seen = 0;
    with_motion(&copy, |_, motion| {
        let matrix: [f32; 9] = motion[3..12].try_into().unwrap();
        first.push(matrix);
        let start = first[seen % 2];
        for (row, column) in (0..9).map(|at| (at / 3, at % 3)) {
            motion[3 + at(row, column)] = (0..3).map(|k| start[at(k, row)] * matrix[at(k, column)]).sum();
        }
        motion[15..18].iter_mut().for_each(|spin| *spin = -*spin);
        seen += 1;
    });
    refused(&copy, "spin contradicts the nodes beside them");

    // a spin that fits neither is not believed, the nodes beside the bodies are
    let copy = Copy::of(FAMILY);
    with_motion(&copy, |_, motion| motion[15..18].fill(-300.0));
    assert_eq!(open(&copy).unwrap().warnings(), [Warning::RigidNodes { count: 4, rates: false }]);

    // the first state is missing: where the bodies start is not told
    let copy = Copy::of(FAMILY);
    let words = open(&copy).unwrap().header().words_per_state as usize;
    let bytes = copy.read("d3plot01");
    copy.write("d3plot01", &bytes[words * 4..]);
    refused(&copy, "no state shows where they start");
}

#[test]
fn bodies_that_do_not_turn_need_no_rotation() {
    let copy = Copy::of(FAMILY);
    let whole = open(&copy).unwrap();
    with_motion(&copy, |_, motion| {
        motion[3..12].copy_from_slice(&[1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0]);
        motion[15..18].fill(0.0);
    });
    let family = open(&copy).unwrap();
    let start = &family.geometry().coordinates;
    let drift = |family: &Family| family.table(2, "rigid_motion").unwrap().unwrap().values[..3].to_vec();
    assert_eq!(drift(&family), drift(&whole));
    let positions = family.coordinates(2).unwrap().unwrap();
    let way = |node: usize| [0, 1, 2].map(|axis| positions[node][axis] - start[node][axis]);
    assert!(near(&way(0), &way(1), 1e-3) && near(&way(1), &way(6), 1e-3));
}

#[test]
fn a_run_with_one_state_needs_no_motion() {
    let copy = Copy::of(FAMILY);
    with_motion(&copy, |_, motion| motion[3..12].fill(0.5));
    let words = Family::open(&testdata().join(FAMILY)).unwrap().header().words_per_state as usize;
    let mark = (-999_999.0_f32).to_le_bytes();
    copy.write("d3plot01", &[&copy.read("d3plot01")[..words * 4], &mark[..]].concat());
    let family = open(&copy).unwrap();
    assert_eq!((family.times(), family.warnings()[0].kind()), (&[0.0][..], "rigid-nodes"));
    let positions = family.coordinates(0).unwrap().unwrap();
    assert!(RIGID.iter().all(|&node| near(&positions[node], &family.geometry().coordinates[node], 1e-3)));
}
