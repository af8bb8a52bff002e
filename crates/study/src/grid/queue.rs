//! Passes that wait for simulation, and their results.

use std::borrow::Cow;
use std::collections::BTreeMap;
use std::fmt::Display;
use std::io;
use std::num::NonZeroUsize;
use std::ops::ControlFlow;

use bristle::model::parameters::MIN_SAMPLES;
use bristle::model::settings::Settings;
use bristle::simulation::{DepthSearch, Found, Job, Kind, Pass, Simulation, of_trim};
use bristle::tool::{Place, places};
use parking_lot::Mutex;

use crate::grid::begun_case::{BegunCase, PassRole};
use crate::grid::case::{CaseResult, tentative};
use crate::grid::scheduler::{in_threads, thread_count, trace_case};
use crate::grid::study::Study;

/// The passes that wait for simulation, and those being simulated.
#[derive(Default)]
struct Queue {
    /// Cases to begin. The first one is last.
    waiting: Vec<(Kind, usize)>,
    begun: BTreeMap<usize, BegunCase>,
    /// Tools of the cases that are begun, by number.
    inquiries: BTreeMap<usize, Inquiry>,
    /// Passes to give out, by kind, tool and place. The first one is last.
    ready: Vec<(Kind, usize, usize)>,
    /// Tool and place of each pass being simulated, by the number of its job.
    running: BTreeMap<usize, (usize, usize)>,
    /// Numbers of tools and of passes so far.
    asked: usize,
    given: usize,
}

/// One tool of a case: the passes of the filaments along its trim. They are repeated at other
/// depths until the tool presses with the force that is asked for.
struct Inquiry {
    case: usize,
    run: PassRole,
    kind: Kind,
    settings: Settings,
    search: Option<DepthSearch<Simulation>>,
    places: Vec<Place>,
    /// Results at this depth, by place.
    results: Vec<Option<Simulation>>,
}

impl Inquiry {
    fn new(case: usize, run: PassRole, kind: Kind, settings: Settings) -> Self {
        let search = DepthSearch::of(&settings, None);
        let mut inquiry = Self {
            case,
            run,
            kind,
            search,
            results: Vec::new(),
            places: Vec::new(),
            settings,
        };
        inquiry.begin_round();
        inquiry
    }

    /// Begins a round of the filaments along the trim, at the depth that is to be simulated.
    fn begin_round(&mut self) {
        self.places = places(&self.at_depth());
        self.results = vec![None; self.places.len()];
    }

    /// Returns the settings at the depth that is being simulated.
    fn at_depth(&self) -> Cow<'_, Settings> {
        match &self.search {
            Some(search) => Cow::Owned(self.settings.at_depth(search.depth())),
            None => Cow::Borrowed(&self.settings),
        }
    }

    /// Returns the pass of the filament at a place, by number.
    fn pass(&self, place: usize) -> Pass {
        Pass::at(&self.at_depth(), self.places[place].s)
    }

    /// Takes the result of a pass. `None` if other passes are still to come, at this depth or at
    /// the next.
    fn take(&mut self, place: usize, result: Simulation) -> Result<Option<Simulation>, String> {
        self.results[place] = Some(result);
        if self.results.contains(&None) {
            return Ok(None);
        }
        let all = self
            .results
            .iter_mut()
            .map(|result| result.take().expect("all are there"))
            .collect();
        let whole = of_trim(&self.places, all);
        let Some(search) = &mut self.search else {
            return Ok(Some(whole));
        };
        let found = search
            .take(whole.metrics.estimated_force(), whole)
            .map_err(|error| error.to_string())?;
        if found.is_none() {
            self.begin_round();
        }
        Ok(found.map(
            |Found {
                 mut result,
                 stiffness,
                 ..
             }| {
                result.metrics.force_stiffness_n_m = stiffness;
                result
            },
        ))
    }

    /// Returns `true` if a round of passes is about to begin.
    fn is_fresh(&self) -> bool {
        self.results.iter().all(Option::is_none)
    }
}

impl Queue {
    /// Gives out the next pass of this kind, or of any kind.
    fn give_out(&mut self, study: &Study, kind: Option<Kind>) -> Option<Job> {
        let fits = |of: Kind| kind.is_none_or(|kind| kind == of);
        if !self.ready.last().is_some_and(|&(of, ..)| fits(of)) {
            self.waiting.last().filter(|&&(of, _)| fits(of))?;
            let (of, case) = self.waiting.pop()?;
            self.begin(study, of, case);
        }
        let (_, asked, place) = self.ready.pop()?;
        let number = self.given;
        self.given += 1;
        self.running.insert(number, (asked, place));
        Some(Job {
            number,
            pass: self.inquiries[&asked].pass(place),
        })
    }

    /// Begins a case. Its sampled tools are of the same kind as the nominal one: scatter neither
    /// adds nor removes dampers or friction.
    fn begin(&mut self, study: &Study, kind: Kind, case: usize) {
        let begun = BegunCase::new(study.settings(case), study.checks());
        for &run in &begun.runs {
            self.inquiries.insert(
                self.asked,
                Inquiry::new(case, run, kind, begun.settings(run)),
            );
            self.make_ready(self.asked);
            self.asked += 1;
        }
        self.begun.insert(case, begun);
    }

    /// Makes the passes of a tool ready.
    fn make_ready(&mut self, asked: usize) {
        let inquiry = &self.inquiries[&asked];
        self.ready.extend(
            (0..inquiry.places.len())
                .rev()
                .map(|place| (inquiry.kind, asked, place)),
        );
    }

    /// Takes the result of a pass. Returns the case and simulation of a nominal tool that it
    /// completes, and the case that it completes.
    fn take<E: Display>(&mut self, number: usize, result: Result<Simulation, E>) -> Taken {
        let Some((asked, place)) = self.running.remove(&number) else {
            return Taken::default();
        };
        let Some(inquiry) = self.inquiries.get_mut(&asked) else {
            return Taken::default();
        };
        let (case, run) = (inquiry.case, inquiry.run);
        let answer = result
            .map_err(|error| error.to_string())
            .and_then(|result| inquiry.take(place, result));
        let Some(answer) = answer.transpose() else {
            if inquiry.is_fresh() {
                self.make_ready(asked);
            }
            return Taken::default();
        };
        self.inquiries.remove(&asked);
        self.ready.retain(|(_, other, _)| *other != asked);
        let Some(begun) = self.begun.get_mut(&case) else {
            return Taken::default();
        };
        let mut taken = Taken::default();
        if begun.take(run, &answer) {
            let inquiries = &mut self.inquiries;
            inquiries.retain(|_, inquiry| inquiry.case != case);
            self.ready
                .retain(|(_, asked, _)| inquiries.contains_key(asked));
            taken.complete = self.begun.remove(&case).map(|begun| (case, begun));
        }
        if matches!(run, PassRole::Nominal) {
            taken.nominal = answer.ok().map(|simulation| (case, simulation));
        }
        taken
    }
}

/// Nominal tool and case that the result of a pass completes.
#[derive(Default)]
struct Taken {
    /// Nominal tool of a case, by number.
    nominal: Option<(usize, Simulation)>,
    complete: Option<(usize, BegunCase)>,
}

/// Simulates cases like [`simulate_cases`](super::simulate_cases), by a function that takes and
/// simulates passes until none is left.
pub(super) fn complete_cases<E: Display>(
    study: &Study,
    cases: &[usize],
    threads: Option<NonZeroUsize>,
    on_pass: impl Fn(usize, &Simulation) + Sync,
    on_case_done: impl Fn(usize, CaseResult) -> ControlFlow<()> + Sync,
    simulate: impl Fn(&dyn Fn(Option<Kind>) -> Option<Job>, &dyn Fn(usize, Result<Simulation, E>))
    + Sync,
) -> io::Result<()> {
    let waiting = in_order_of_work(study, cases);
    let threads = thread_count(threads);
    // Where tools are sampled, a single case has passes for several threads.
    let tools = if study.scatters() { MIN_SAMPLES } else { 1 };
    let along = cases
        .first()
        .map_or(1, |&case| places(&study.settings(case)).len());
    let passes = waiting.len().saturating_mul(tools * along);
    let threads = threads.min(passes);

    let queue = Mutex::new(Queue {
        waiting,
        ..Queue::default()
    });
    let queued = || queue.lock();
    let take = |kind: Option<Kind>| queued().give_out(study, kind);
    let done = |number: usize, result: Result<Simulation, E>| {
        let Taken { nominal, complete } = queued().take(number, result);
        if let Some((case, simulation)) = nominal {
            on_pass(case, &simulation);
        }
        let Some((case, begun)) = complete else {
            return;
        };
        let start = begun.start;
        let result = begun.conclude();
        trace_case(case, &result, start);
        if on_case_done(case, result).is_break() {
            let mut queue = queued();
            queue.waiting.clear();
            queue.ready.clear();
        }
    };
    in_threads(study, cases.len(), threads, || simulate(&take, &done))
}

/// Returns the cases with their kinds, in reverse order of simulation. They are simulated kind by
/// kind, and within a kind the longest passes first, so that threads and lanes finish at the same
/// time.
pub(super) fn in_order_of_work(study: &Study, cases: &[usize]) -> Vec<(Kind, usize)> {
    let of_case = |&number: &usize| {
        let pass = Pass::new(&tentative(study.settings(number)));
        (pass.kind(), pass.end_time(), number)
    };
    let mut cases: Vec<(Kind, f64, usize)> = cases.iter().map(of_case).collect();
    cases.sort_by(|a, b| a.0.cmp(&b.0).then(a.1.total_cmp(&b.1)).then(b.2.cmp(&a.2)));
    cases
        .into_iter()
        .map(|(kind, _, number)| (kind, number))
        .collect()
}
