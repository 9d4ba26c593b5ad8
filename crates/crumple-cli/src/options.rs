//! Options that several commands share, and what they mean to the library. Defaults live there, not here.

use std::path::{Path, PathBuf};
use std::sync::Arc;

use clap::Args;
use crumple::Error;
use crumple::basis::BasisOptions;
use crumple::deck;
use crumple::descriptor::{DescribeOptions, Select, Threshold};
use crumple::inputs::Table;
use crumple::joints::Join;
use crumple::modes::ModesOptions;
use crumple::run::Run;
use crumple::similarity::SimilarityOptions;
use crumple::study::Rows;

/// The surface and its eigenbasis.
#[derive(Args)]
pub(crate) struct BasisArgs {
    /// Part whose shells make the surface, by id or title; may be given several times [default: all shells]
    #[arg(long = "part", value_name = "PART")]
    pub(crate) parts: Vec<String>,
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
        Ok(BasisOptions { eigenpairs: self.eigenpairs.unwrap_or(default.eigenpairs), join })
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
    /// Number of modes, 1 or more [default: the number from 2 to 8 with the best mean silhouette]
    #[arg(long, value_name = "N", allow_negative_numbers = true)]
    count: Option<usize>,
    /// Seed of the random starts; the same seed gives the same modes [default: 1]
    #[arg(long, value_name = "S", allow_negative_numbers = true)]
    seed: Option<u64>,
    /// What makes runs alike: `rotation`, the kind and direction of the deformation wherever it happens, or
    /// `displacement`, where every place ends up, as in the paper [default: rotation]
    #[arg(long, value_name = "WHAT")]
    by: Option<String>,
    /// How to group: kmeans, ward or average [default: kmeans]
    #[arg(long, value_name = "METHOD")]
    method: Option<String>,
}

impl ModesArgs {
    pub(crate) fn options(&self) -> Result<ModesOptions, Error> {
        let default = ModesOptions::default();
        let method = self.method.as_deref().map(str::parse).transpose()?;
        let by = self.by.as_deref().map(str::parse).transpose()?.unwrap_or(default.by);
        Ok(ModesOptions {
            count: self.count,
            seed: self.seed.unwrap_or(default.seed),
            method: method.unwrap_or(default.method),
            by,
        })
    }
}

/// Building a descriptor.
#[derive(Args)]
pub(crate) struct DescribeArgs {
    /// What makes an eigenvector matter: large coefficients of the `coordinates`, or a large `difference` to the
    /// undeformed part [default: coordinates]
    #[arg(long, value_name = "WHAT")]
    select: Option<String>,
    /// How large is large: std:C (mean + C standard deviations; the paper's is std:1), mean:C, value:T, top:M (the M
    /// largest), energy:SHARE, error:MM (as many as the reconstruction needs to be that close) [default: std:1]
    #[arg(long, value_name = "RULE")]
    threshold: Option<String>,
}

impl DescribeArgs {
    /// What was asked for; `None` where nothing was.
    pub(crate) fn asked(&self) -> Result<Option<DescribeOptions>, Error> {
        let options = self.options()?;
        Ok((self.select.is_some() || self.threshold.is_some()).then_some(options))
    }

    pub(crate) fn options(&self) -> Result<DescribeOptions, Error> {
        let select = select(self.select.as_deref())?;
        let threshold: Option<Threshold> = self.threshold.as_deref().map(str::parse).transpose()?;
        Ok(DescribeOptions { select, threshold: threshold.unwrap_or_default() })
    }
}

/// Comparing with a descriptor.
#[derive(Args)]
pub(crate) struct SimilarityArgs {
    /// The measure: cosine (the paper's), euclidean (RMS distance in the length unit) or mahalanobis [default: cosine]
    #[arg(long, value_name = "METRIC")]
    metric: Option<String>,
    /// Compare differences from the mean of all runs, not the coefficients themselves
    #[arg(long)]
    centred: bool,
    /// Weights of the coefficients: none, frequency (√λ) or spread (1 / standard deviation) [default: none]
    #[arg(long, value_name = "WEIGHT")]
    weight: Option<String>,
}

impl SimilarityArgs {
    pub(crate) fn options(&self) -> Result<SimilarityOptions, Error> {
        let metric = self.metric.as_deref().map(str::parse).transpose()?.unwrap_or_default();
        let weight = self.weight.as_deref().map(str::parse).transpose()?.unwrap_or_default();
        Ok(SimilarityOptions { centred: self.centred, weight, metric })
    }
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
