//! Nodes of rigid bodies that the states leave out (NDIM 8, 9), put back where their bodies are.
//!
//! For each body a state has the position of its centre c and the nine words of a matrix R; with NDIM 8 also the velocity
//! of the centre, the spin, and their rates. A node that starts at X is at c + D (X − c₀), where D turns the body from the
//! first state to this one. Whether the nine words stand by rows, D = R R₀ᵀ, or by columns, D = Rᵀ R₀, the manual does not
//! say, and no real file was at hand. So the file decides: by the spin, which turns the matrix from one state to the next,
//! and by the nodes beside the body, which the states hold and which move about as it does. Where neither tells, the
//! family is refused.

use crate::error::Error;
use crate::family::Family;
use crate::rigid::{NO_BODY, uncertain_rigid_bodies};
use crate::rotation::{
    Matrix, Vector, cross, is_identity, is_rotation, mean, minus, plus, rotation_vector, square, times, turn,
};
use crate::values::{Real, Rows};

/// States that are looked at to learn how to read the motion.
const LOOKS: usize = 16;
/// Nodes beside the bodies that are looked at.
const NEIGHBOURS: usize = 4096;
/// Entries of D − 1 up to which a body has not turned.
const UNTURNED: f64 = 1e-5;
/// One reading is believed if it leaves this many times less unexplained, as a sum of squares, than the other.
const CLEARLY: f64 = 4.0;
/// Turns between two states, in radians, from which on the mean of two spins says nothing.
const COARSE: f64 = 2.0;

/// How the motion of the bodies is to be read.
#[derive(Debug, Clone)]
pub(crate) struct Motion {
    by_columns: bool,
    /// Velocity and spin fit the positions: velocity and acceleration of nodes can be told from them.
    rates: bool,
    /// The bodies in the first state.
    start: Vec<Pose>,
}

/// A body in a state.
#[derive(Debug, Clone, Copy, Default)]
struct Pose {
    centre: Vector,
    matrix: Matrix,
    velocity: Vector,
    spin: Vector,
    acceleration: Vector,
    spin_rate: Vector,
}

impl Motion {
    /// Learns how the motion of the bodies of this family is to be read; `None` if its states leave out no nodes.
    pub(crate) fn of(family: &Family) -> Result<Option<Motion>, Error> {
        let Some(active) = &family.reading.active else { return Ok(None) };
        let refuse = |why: &str| Err(uncertain_rigid_bodies(&family.control, &family.stream, why));
        if family.starts.is_empty() {
            return Ok(None);
        }
        if active.is_empty() {
            return refuse("with no node left in them");
        }
        let nodal = family.layout.fields.iter().filter(|field| leaves_out_rigid_nodes(field.name));
        if !nodal.into_iter().any(|field| field.rows != family.control.nodes) {
            return Ok(None);
        }
        let start = poses(family, 0)?;
        if start.len() as u64 != family.reading.rigid_bodies {
            return refuse("without the motion of the bodies");
        }
        if !starts_at_rest(family, active)? {
            return refuse("and no state shows where they start");
        }
        let mut motion = Motion { by_columns: false, rates: false, start };
        let count = family.starts.len();
        if count == 1 {
            return Ok(Some(motion)); // nothing has moved yet
        }
        let (mut turned, mut beside, mut spun, mut went) =
            (false, Misfit::default(), Misfit::default(), Misfit::default());
        let neighbours = neighbours(family);
        let mut looks: Vec<usize> = (0..LOOKS).map(|look| look * (count - 1) / (LOOKS - 1)).collect();
        looks.dedup();
        for state in looks {
            let here = poses(family, state)?;
            if !here.iter().all(|pose| is_rotation(&pose.matrix)) {
                return refuse("with matrices that are no rotations");
            }
            turned |= here.iter().zip(&motion.start).any(|(pose, start)| has_turned(pose, start));
            motion.look_beside(family, state, &here, &neighbours, &mut beside)?;
            if state + 1 < count {
                let step = family.times()[state + 1] - family.times()[state];
                for (before, after) in here.iter().zip(&poses(family, state + 1)?) {
                    spun.add_turn(before, after, step);
                    went.add_way(before, after, step);
                }
            }
        }
        let by_spin = spun.by_columns().filter(|_| spun.fits());
        motion.by_columns = match (by_spin, beside.by_columns()) {
            (Some(spin), Some(beside)) if spin != beside => {
                return refuse("whose spin contradicts the nodes beside them");
            }
            (Some(by_columns), _) | (None, Some(by_columns)) => by_columns,
            (None, None) if turned => return refuse("whose rotation could be read in two ways"),
            (None, None) => false,
        };
        let has_rates = family.layout.field("rigid_motion").is_some_and(|field| field.columns >= 24);
        motion.rates = has_rates && spun.fits() && went.fits();
        Ok(Some(motion))
    }

    /// Whether velocity and acceleration of the nodes can be told, too.
    pub(crate) fn has_rates(&self) -> bool {
        self.rates
    }

    /// The rotation of a body since the first state.
    fn turn(&self, pose: &Pose, start: &Pose) -> Matrix {
        turn(&pose.matrix, &start.matrix, self.by_columns)
    }

    /// How far the nodes beside a body are from where they would be if they belonged to it.
    fn look_beside(
        &self,
        family: &Family,
        state: usize,
        here: &[Pose],
        neighbours: &[(u32, u32)],
        beside: &mut Misfit,
    ) -> Result<(), Error> {
        let nodes: Vec<u32> = neighbours.iter().map(|(node, _)| *node).collect();
        let mut positions: Vec<f64> = Vec::new();
        let columns = family.values_into(state, "coordinates", Rows::These(&nodes), &mut positions)?;
        if columns != Some(3) {
            return Ok(());
        }
        for (&(node, body), position) in neighbours.iter().zip(positions.as_chunks::<3>().0) {
            let (pose, start) = (&here[body as usize], &self.start[body as usize]);
            let arm = minus(&family.geometry().coordinates[node as usize], &start.centre);
            let at = minus(position, &pose.centre);
            let miss = |by_columns| minus(&at, &times(&turn(&pose.matrix, &start.matrix, by_columns), &arm));
            beside.add(&miss(false), &miss(true), &at);
        }
        Ok(())
    }

    /// Puts values of left-out nodes into the rows of `into` that are theirs: positions, displacements, velocity or
    /// acceleration, as `field` says.
    pub(crate) fn fill<T: Real>(
        &self,
        family: &Family,
        state: usize,
        field: &str,
        rows: Rows,
        into: &mut [T],
    ) -> Result<(), Error> {
        if matches!(field, "velocity" | "acceleration") && !self.rates {
            return Ok(());
        }
        let here = poses(family, state)?;
        for (place, row) in into.as_chunks_mut::<3>().0.iter_mut().enumerate() {
            let node = match rows {
                Rows::All => place,
                Rows::These(rows) => rows[place] as usize,
            };
            let Some(body) = family.reading.body_of.get(node).filter(|&&body| body != NO_BODY) else { continue };
            let (Some(pose), Some(start)) = (here.get(*body as usize), self.start.get(*body as usize)) else {
                continue;
            };
            if state > 0 && !is_rotation(&pose.matrix) {
                continue;
            }
            let origin = &family.geometry().coordinates[node];
            let arm = minus(origin, &start.centre);
            // the first state is where the bodies start
            let arm = if state == 0 { arm } else { times(&self.turn(pose, start), &arm) };
            let value = match field {
                "velocity" => plus(&pose.velocity, &cross(&pose.spin, &arm)),
                "acceleration" => {
                    let inward = cross(&pose.spin, &cross(&pose.spin, &arm));
                    plus(&plus(&pose.acceleration, &cross(&pose.spin_rate, &arm)), &inward)
                }
                // `coordinates` of families with displacements get their start added by the caller
                "displacement" => minus(&plus(&pose.centre, &arm), origin),
                _ => plus(&pose.centre, &arm),
            };
            *row = value.map(T::of);
        }
        Ok(())
    }
}

/// Tables that have no rows for nodes of rigid bodies.
pub(crate) fn leaves_out_rigid_nodes(field: &str) -> bool {
    matches!(field, "coordinates" | "displacement" | "velocity" | "acceleration")
}

/// The bodies in a state; none if the state does not hold their motion.
fn poses(family: &Family, state: usize) -> Result<Vec<Pose>, Error> {
    let Some(table) = family.table(state, "rigid_motion")? else { return Ok(Vec::new()) };
    Ok(table
        .rows()
        .map(|row| {
            let at = |place: usize| {
                row.get(3 * place..).and_then(|rest| rest.first_chunk::<3>()).copied().unwrap_or_default()
            };
            Pose {
                centre: at(0),
                matrix: [at(1), at(2), at(3)],
                velocity: at(4),
                spin: at(5),
                acceleration: at(6),
                spin_rate: at(7),
            }
        })
        .collect())
}

/// Whether the nodes that the states hold are in the first one where the geometry has them: then so are the bodies.
fn starts_at_rest(family: &Family, active: &[u32]) -> Result<bool, Error> {
    let mut positions: Vec<f64> = Vec::new();
    let columns = family.values_into(0, "coordinates", Rows::These(active), &mut positions)?;
    let origins = active.iter().map(|&node| &family.geometry().coordinates[node as usize]);
    let largest = origins.clone().flatten().fold(0.0, |most: f64, value| most.max(value.abs()));
    let unmoved = positions
        .as_chunks::<3>()
        .0
        .iter()
        .zip(origins)
        .all(|(position, origin)| minus(position, origin).iter().all(|way| way.abs() <= 1e-5 * largest));
    // without positions in the states the time has to do
    Ok(if columns == Some(3) { unmoved } else { family.times()[0] == 0.0 })
}

/// Nodes that the states hold and that share an element with a node of a body, each with that body; a number of them.
fn neighbours(family: &Family) -> Vec<(u32, u32)> {
    let geometry = family.geometry();
    let body = |node: u32| family.reading.body_of.get(node as usize).copied().unwrap_or(NO_BODY);
    let mut found = Vec::new();
    let mut element = |nodes: &[u32]| {
        let Some(&rigid) = nodes.iter().find(|node| body(**node) != NO_BODY) else { return };
        if found.len() < NEIGHBOURS {
            found.extend(nodes.iter().filter(|node| body(**node) == NO_BODY).map(|node| (*node, body(rigid))));
        }
    };
    geometry.shells.iter().for_each(|shell| element(&shell.nodes));
    geometry.solids.iter().chain(&geometry.thick_shells).for_each(|solid| element(&solid.nodes));
    found.sort_unstable();
    found.dedup();
    found
}

/// What the two readings of the matrix leave unexplained, as sums of squares.
#[derive(Debug, Clone, Copy, Default)]
struct Misfit {
    by_rows: f64,
    by_columns: f64,
    /// Of what was to be explained.
    whole: f64,
}

impl Misfit {
    fn add(&mut self, by_rows: &Vector, by_columns: &Vector, whole: &Vector) {
        self.by_rows += square(by_rows);
        self.by_columns += square(by_columns);
        self.whole += square(whole);
    }

    /// The turn from one state to the next against the spin.
    fn add_turn(&mut self, before: &Pose, after: &Pose, step: f64) {
        let spun = mean(&before.spin, &after.spin).map(|spin| spin * step);
        if square(&spun).sqrt() > COARSE {
            return;
        }
        let miss = |by_columns| minus(&rotation_vector(&turn(&after.matrix, &before.matrix, by_columns)), &spun);
        self.add(&miss(false), &miss(true), &spun);
    }

    /// The way from one state to the next against the velocity, which does not depend on the matrix.
    fn add_way(&mut self, before: &Pose, after: &Pose, step: f64) {
        let expected = mean(&before.velocity, &after.velocity).map(|velocity| velocity * step);
        let miss = minus(&minus(&after.centre, &before.centre), &expected);
        self.add(&miss, &miss, &expected);
    }

    /// The reading that clearly explains more.
    fn by_columns(&self) -> Option<bool> {
        let clearly = |less: f64, more: f64| less < more && CLEARLY * less <= more;
        match (clearly(self.by_rows, self.by_columns), clearly(self.by_columns, self.by_rows)) {
            (true, _) => Some(false),
            (_, true) => Some(true),
            _ => None,
        }
    }

    /// Whether the better reading explains most of it; rounding apart.
    fn fits(&self) -> bool {
        CLEARLY * self.by_rows.min(self.by_columns) <= self.whole + UNTURNED * UNTURNED
    }
}

fn has_turned(pose: &Pose, start: &Pose) -> bool {
    !is_identity(&turn(&pose.matrix, &start.matrix, false), UNTURNED)
}
