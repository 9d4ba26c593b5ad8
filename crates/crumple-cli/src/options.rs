//! Options that several commands share, and what they mean to the library. Defaults live there, not here.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use crumple::Error;
use crumple::basis::BasisOptions;
use crumple::deck;
use crumple::descriptor::{self, DescribeOptions, Descriptor, Select, Set};
use crumple::field::Field;
use crumple::inputs::Table;
use crumple::joints::Join;
use crumple::modes::{Along, ModesOptions, States};
use crumple::run::Run;
use crumple::similarity::SimilarityOptions;
use crumple::study::{Function, Loaded, Rows};
use crumple::{Kind, Mass, UnknownName};

/// The operator.
#[derive(Args)]
pub(crate) struct OperatorArgs {
    /// Discretisation of the Laplacian: cotan, tufted (any faces, no negative weights; for meshes that are non-manifold
    /// or badly shaped) or polygon (quads without choosing a diagonal) [default: cotan]
    #[arg(long, value_name = "OPERATOR")]
    operator: Option<String>,
    /// Mass matrix: lumped (a third of each triangle's area to each corner), consistent (not diagonal; slower) or
    /// identity (every vertex the same, as the paper's formula has it) [default: lumped]
    #[arg(long, value_name = "MASS")]
    mass: Option<String>,
}

impl OperatorArgs {
    pub(crate) fn kinds(&self) -> Result<(Kind, Mass), Error> {
        let wrong =
            |name| move |error: UnknownName| Error::Value { name, value: error.name, expected: error.expected.into() };
        let kind = self.operator.as_deref().map(str::parse).transpose().map_err(wrong("--operator"))?;
        let mass = self.mass.as_deref().map(str::parse).transpose().map_err(wrong("--mass"))?;
        Ok((kind.unwrap_or_default(), mass.unwrap_or_default()))
    }
}

/// The surface and its eigenbasis.
#[derive(Args)]
pub(crate) struct BasisArgs {
    /// Part whose shells make the surface, by id or title; may be given several times [default: all shells]
    #[arg(long = "part", value_name = "PART")]
    pub(crate) parts: Vec<String>,
    #[command(flatten)]
    operator: OperatorArgs,
    /// Quantity of the result files to project beside the shape: plastic_strain, temperature, velocity, acceleration;
    /// plastic_strain:outer (max, min, mean, inner, outer) for one layer of shells; may be given several times
    #[arg(long = "field", value_name = "FIELD")]
    fields: Vec<String>,
    /// Treat separate sheets as one. A distance: mutually nearest vertices of different pieces of the mesh that are closer
    /// (length unit of the model) share one degree of freedom; `init` recommends one where sheets lie close. `deck`: what
    /// the deck's spot welds, rigid bodies and tied contacts hold moves together
    #[arg(long, value_name = "DISTANCE|deck", allow_negative_numbers = true)]
    join: Option<String>,
    /// Keyword deck (.k, .key, .dyn) of the model: titles of parts, and the welds and ties that `--join deck` needs
    /// [default: the reference itself where it is a deck; for a study the deck it was made with]
    #[arg(long, value_name = "FILE")]
    deck: Option<PathBuf>,
    /// Eigenpairs K of the basis, 1 or more; each costs time and space, and resolves finer folds [default: 500]
    #[arg(short = 'K', long, value_name = "K", allow_negative_numbers = true)]
    eigenpairs: Option<usize>,
}

impl BasisArgs {
    pub(crate) fn fields(&self) -> Result<Vec<Field>, Error> {
        let mut fields: Vec<Field> = self.fields.iter().map(|name| name.parse()).collect::<Result<_, _>>()?;
        fields.sort_unstable();
        fields.dedup();
        Ok(fields)
    }

    pub(crate) fn options(&self) -> Result<BasisOptions, Error> {
        let default = BasisOptions::default();
        let join = match self.join.as_deref() {
            None => None,
            Some("deck") => Some(Join::DECK),
            Some(text) => Some(Join::Distance(text.parse().map_err(|_| Error::Value {
                name: "--join",
                value: text.to_owned(),
                expected: "a distance in the model's length unit, or the word deck".into(),
            })?)),
        };
        let (kind, mass) = self.operator.kinds()?;
        Ok(BasisOptions { eigenpairs: self.eigenpairs.unwrap_or(default.eigenpairs), join, kind, mass })
    }

    /// The reference run with its deck: the one given, or `known` (a study's own).
    pub(crate) fn with_deck(&self, run: Run, known: Option<&Path>) -> Result<Run, Error> {
        match self.deck.as_deref().or(known.filter(|_| run.deck().is_none())) {
            Some(path) => Ok(run.with_deck(Arc::new(deck::read(path)?))),
            None => Ok(run),
        }
    }
}

/// Adding runs.
#[derive(Args)]
pub(crate) struct AddArgs {
    /// Table (CSV) of inputs or responses, kept per run: the run in the first column, by id or by its number
    #[arg(long, value_name = "CSV")]
    params: Option<PathBuf>,
    /// Leave out runs that cannot be read or that have another mesh, instead of adding nothing
    #[arg(long)]
    pub(crate) skip_bad: bool,
    /// A run whose id is there with another content takes its place
    #[arg(long)]
    pub(crate) replace: bool,
}

impl AddArgs {
    pub(crate) fn table(&self) -> Result<Option<Table>, Error> {
        self.params.as_deref().map(Table::read).transpose()
    }
}

/// Grouping into modes.
#[derive(Args)]
pub(crate) struct ModesArgs {
    /// Number of modes, 1 or more [default: the best of 2 to 8, see --choose; hdbscan finds its own]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    count: Option<usize>,
    /// What decides between numbers of modes: the mean `silhouette`, or the `stability` of the groups when runs are left out;
    /// both are shown [default: silhouette]
    #[arg(long, value_name = "EVIDENCE")]
    choose: Option<String>,
    /// Seed of the random starts and samples; the same seed gives the same modes [default: 1]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    seed: Option<u64>,
    /// What makes runs alike: `rotation`, the kind and direction of the deformation wherever it happens, `displacement`,
    /// where every place ends up, as in the paper (also: `paper`), `coordinates`, which have the distances of the
    /// displacement, a field that the study keeps, or a shape and a field together, each by its spread in the study, as
    /// displacement,plastic_strain [default: rotation]
    #[arg(long, value_name = "WHAT")]
    by: Option<String>,
    /// How to group: kmeans, ward, average, mixture (of Gaussians), or hdbscan, which leaves runs in no dense group without a
    /// mode [default: kmeans]
    #[arg(long, value_name = "METHOD")]
    method: Option<String>,
    /// Fewest runs of a mode, with --method hdbscan [default: a quarter of the runs, 2 to 5]
    #[arg(long, value_name = "RUNS", allow_negative_numbers = true)]
    smallest: Option<usize>,
    /// Which states of each run are grouped: the `last`, or the whole `series`, see --align [default: last]
    #[arg(long, value_name = "WHICH")]
    states: Option<String>,
    /// Group by the states at this time instead of the last, interpolated; may be given several times
    #[arg(long = "at", value_name = "TIME", allow_negative_numbers = true, conflicts_with_all = ["states", "at_intrusion"])]
    at: Vec<f64>,
    /// Group by the states at this share of the RMS displacement that all runs reach; may be given several times
    #[arg(long, value_name = "SHARE", allow_negative_numbers = true, conflicts_with = "states")]
    at_intrusion: Vec<f64>,
    /// What whole series are aligned by: `time` or `intrusion`, the RMS displacement [default: time]
    #[arg(long, value_name = "ALONG")]
    align: Option<String>,
}

impl ModesArgs {
    /// Whether anything was asked for.
    pub(crate) fn asked(&self) -> bool {
        let Self { count, choose, seed, by, method, smallest, states, at, at_intrusion, align } = self;
        count.is_some()
            || seed.is_some()
            || smallest.is_some()
            || [choose, by, method, states, align].iter().any(|option| option.is_some())
            || !at.is_empty()
            || !at_intrusion.is_empty()
    }

    pub(crate) fn options(&self) -> Result<ModesOptions, Error> {
        let default = ModesOptions::default();
        let choose = self.choose.as_deref().map(str::parse).transpose()?;
        let method = self.method.as_deref().map(str::parse).transpose()?;
        let by = self.by.as_deref().map(str::parse).transpose()?;
        Ok(ModesOptions {
            count: self.count,
            choose: choose.unwrap_or(default.choose),
            seed: self.seed.unwrap_or(default.seed),
            method: method.unwrap_or(default.method),
            smallest: self.smallest,
            by: by.unwrap_or(default.by),
            states: self.states()?,
        })
    }

    fn states(&self) -> Result<States, Error> {
        let align: Option<Along> = self.align.as_deref().map(str::parse).transpose()?;
        if !self.at.is_empty() {
            return Ok(States::At { along: Along::Time, stations: self.at.clone() });
        }
        if !self.at_intrusion.is_empty() {
            return Ok(States::At { along: Along::Intrusion, stations: self.at_intrusion.clone() });
        }
        match (self.states.as_deref(), align) {
            (None | Some("last"), None) => Ok(States::Last),
            (Some("series"), align) => Ok(States::Series { along: align.unwrap_or_default() }),
            (Some("last") | None, Some(_)) => Err(Error::Value {
                name: "--align",
                value: self.align.clone().unwrap_or_default(),
                expected: "--states series beside it; last states are not aligned".into(),
            }),
            (Some(other), _) => {
                Err(Error::Value { name: "--states", value: other.into(), expected: "last or series".into() })
            }
        }
    }
}

/// Building a descriptor.
#[derive(Args)]
pub(crate) struct DescribeArgs {
    /// What search, verify and the others compare with it: `rotation`, the spectrum of the rotation field, or `paper`,
    /// the coefficients on the eigenvectors that matter; both are saved [default: rotation]
    #[arg(long, value_name = "KIND")]
    kind: Option<String>,
    /// What makes an eigenvector matter: large coefficients of the `coordinates`, or a large `difference` to the
    /// undeformed part [default: coordinates]
    #[arg(long, value_name = "WHAT")]
    select: Option<String>,
    /// How large is large: std:C (mean + C standard deviations; the paper's is std:1), mean:C, value:T, top:M (the M
    /// largest), energy:SHARE, error:MM (as many as the reconstruction needs to be that close) [default: std:1]
    #[arg(long, value_name = "RULE")]
    threshold: Option<String>,
    /// Compare values with t as the paper's equation is printed (α > t), not their magnitudes as its text says
    #[arg(long)]
    signed: bool,
    /// Keep nearly equal eigenvalues together, so that the descriptor does not depend on the basis inside them
    #[arg(long)]
    whole_clusters: bool,
    /// Which functions on the surface: shape, a field that the study keeps (plastic_strain), or several with commas;
    /// several are scaled by their spread in the study [default: shape]
    #[arg(long, value_name = "FUNCTIONS")]
    of: Option<String>,
}

impl DescribeArgs {
    /// What was asked for; `None` where nothing was.
    pub(crate) fn asked(&self) -> Result<Option<DescribeOptions>, Error> {
        let options = self.options(Set::default())?;
        Ok((options != DescribeOptions::default()).then_some(options))
    }

    pub(crate) fn options(&self, set: Set) -> Result<DescribeOptions, Error> {
        let default = DescribeOptions::default();
        Ok(DescribeOptions {
            kind: self.kind.as_deref().map(str::parse).transpose()?.unwrap_or(default.kind),
            select: select(self.select.as_deref())?,
            threshold: self.threshold.as_deref().map(str::parse).transpose()?.unwrap_or(default.threshold),
            signed: self.signed,
            whole_clusters: self.whole_clusters,
            functions: self.of.as_deref().map_or(Ok(default.functions), functions)?,
            set,
        })
    }
}

/// `shape`, fields, or several of them with commas.
fn functions(text: &str) -> Result<Vec<Function>, Error> {
    let one = |name: &str| match name.trim() {
        "shape" => Ok(Function::Displacement),
        field => field.parse().map(Function::Field),
    };
    let mut functions: Vec<Function> = text.split(',').map(one).collect::<Result<_, _>>()?;
    functions.sort_unstable();
    functions.dedup();
    Ok(functions)
}

/// Which descriptor, and how states are compared with it.
#[derive(Args)]
pub(crate) struct SimilarityArgs {
    /// Which of the descriptor's numbers: `rotation`, the spectrum of the rotation field, which finds a deformation
    /// wherever on the part it happens, or `paper`, coefficients on the eigenvectors that matter [default: what the
    /// descriptor was made for; paper with --metric euclidean and --weight frequency]
    #[arg(long, value_name = "KIND")]
    kind: Option<String>,
    /// Compare only the coefficients of these eigenvectors, as 3,5,8-12, in place of the descriptor's own (kind paper)
    #[arg(long, value_name = "LIST", conflicts_with = "kind")]
    eigenvectors: Option<String>,
    /// The measure: cosine (the paper's), euclidean (RMS distance in the length unit) or mahalanobis [default: cosine]
    #[arg(long, value_name = "METRIC")]
    metric: Option<String>,
    /// Compare differences from the mean of all runs, not the numbers themselves
    #[arg(long)]
    centred: bool,
    /// Weights of the coefficients: none, frequency (√λ) or spread (1 / standard deviation) [default: none]
    #[arg(long, value_name = "WEIGHT")]
    weight: Option<String>,
}

impl SimilarityArgs {
    pub(crate) fn options(&self) -> Result<SimilarityOptions, Error> {
        let kind = self.kind.as_deref().map(str::parse).transpose()?;
        let metric = self.metric.as_deref().map(str::parse).transpose()?.unwrap_or_default();
        let weight = self.weight.as_deref().map(str::parse).transpose()?.unwrap_or_default();
        Ok(SimilarityOptions { kind, centred: self.centred, weight, metric })
    }

    /// The descriptor that a word means.
    pub(crate) fn descriptor(&self, loaded: &Loaded, word: &str) -> Result<Descriptor, Error> {
        let only = self.eigenvectors.as_deref().map(numbers).transpose()?;
        descriptor::find(loaded, word, only.as_deref())
    }
}

/// Numbers from 1, as `3,5,8-12`.
fn numbers(text: &str) -> Result<Vec<usize>, Error> {
    let wrong = || Error::Value {
        name: "--eigenvectors",
        value: text.to_owned(),
        expected: "numbers from 1 and ranges of them, as 3,5,8-12".into(),
    };
    let number =
        |text: &str| text.trim().parse::<usize>().ok().filter(|&j| (1..=1_000_000).contains(&j)).ok_or_else(wrong);
    let mut all = Vec::new();
    for item in text.split(',') {
        let (first, last) = match item.split_once('-') {
            Some((first, last)) => (number(first)?, number(last)?),
            None => (number(item)?, number(item)?),
        };
        if first > last {
            return Err(wrong());
        }
        all.extend(first..=last);
    }
    Ok(all)
}

/// `coordinates` or `difference`.
pub(crate) fn select(text: Option<&str>) -> Result<Select, Error> {
    match text {
        None => Ok(Select::default()),
        Some("coordinates") => Ok(Select::Coordinates),
        Some("difference") => Ok(Select::Difference),
        Some(other) => {
            Err(Error::Value { name: "--select", value: other.into(), expected: "coordinates or difference".into() })
        }
    }
}

/// `last` or `all`.
pub(crate) fn rows(text: Option<&str>) -> Result<Rows<'static>, Error> {
    match text {
        None | Some("last") => Ok(Rows::Last),
        Some("all") => Ok(Rows::All),
        Some(other) => Err(Error::Value { name: "--states", value: other.into(), expected: "last or all".into() }),
    }
}
