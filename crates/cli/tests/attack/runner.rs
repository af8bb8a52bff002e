//! Runs an attack: makes mutants, judges what becomes of them, and counts.

use std::cell::RefCell;
use std::collections::BTreeMap;
use std::error::Error;
use std::fs::{self, File};
use std::io;
use std::os::unix::fs::FileExt;
use std::panic::{AssertUnwindSafe, catch_unwind, set_hook, take_hook};
use std::path::{Path, PathBuf};
use std::process;
use std::sync::atomic::{AtomicBool, AtomicUsize, Ordering};
use std::sync::{Mutex, MutexGuard};
use std::thread;
use std::time::{Duration, Instant};

use allocation_counter::measure;
use fastrand::Rng;

/// Longest message about bad input, in characters and in lines.
const LONGEST_MESSAGE: usize = 4_000;
const MOST_LINES: usize = 40;
/// Bytes of memory for each byte of a file: a tree takes more than its text.
const MEMORY_PER_BYTE: u64 = 200;
/// Failures that are shown of one target.
const MOST_SHOWN: usize = 20;

/// Something that reads files.
pub trait Target: Sync {
    /// Its name on the command line.
    fn name(&self) -> &'static str;

    /// Number of mutants in the short run.
    fn count(&self) -> usize;

    /// Bounds on one mutant.
    fn limits(&self) -> Limits {
        Limits::default()
    }

    /// Valid files, all of which must be accepted.
    fn originals(&self) -> Vec<Mutant>;

    /// Invalid files, and a part of the message that they must be refused with.
    fn refusals(&self) -> Vec<(Mutant, &'static str)> {
        Vec::new()
    }

    /// Damaged files.
    fn mutant(&self, random: &mut Rng) -> Mutant;

    /// Reads the files. Panics if the reader is wrong.
    fn check(&self, mutant: &Mutant, random: &mut Rng) -> Verdict;

    /// What else was done with accepted mutants, by name; nothing may be left out.
    fn further(&self) -> Vec<(&'static str, usize)> {
        Vec::new()
    }
}

/// Files to read, and the call that reads them.
#[derive(Clone, Debug, Default)]
pub struct Mutant {
    /// The change that made it.
    pub change: &'static str,
    /// Names and contents.
    pub files: Vec<(String, Vec<u8>)>,
    /// Arguments, if a program reads the files.
    pub call: Vec<String>,
    /// What a shell does before the call, and where the call writes.
    pub before: &'static str,
    pub redirection: &'static str,
}

impl Limits {
    /// The limits for reading some files.
    fn reading(self, mutant: &Mutant) -> Self {
        let length: usize = mutant.files.iter().map(|(_, content)| content.len()).sum();
        Self {
            memory: self.memory + MEMORY_PER_BYTE * length as u64,
            ..self
        }
    }
}

impl Mutant {
    /// One file.
    pub fn file(change: &'static str, name: &str, content: impl Into<Vec<u8>>) -> Self {
        Self {
            change,
            files: vec![(name.to_owned(), content.into())],
            ..Self::default()
        }
    }

    /// The content of a file as text; readers of text never see anything else.
    pub fn text(&self, file: usize) -> String {
        String::from_utf8_lossy(&self.files[file].1).into_owned()
    }
}

/// What became of a mutant: it was read, or refused.
pub type Verdict = Result<(), Refused>;

/// The message with which a mutant was refused.
#[derive(Clone, Debug, PartialEq)]
pub struct Refused(pub String);

impl<E: Error> From<E> for Refused {
    fn from(error: E) -> Self {
        Self(error.to_string())
    }
}

/// Bounds on the work for one mutant.
#[derive(Clone, Copy, Debug)]
pub struct Limits {
    /// Time: far more than an idle machine needs, as a busy one may need fifty times as much.
    pub time: Duration,
    /// Memory in bytes at any one time, for a file of no length.
    pub memory: u64,
}

impl Default for Limits {
    fn default() -> Self {
        Self {
            time: Duration::from_secs(60),
            memory: 64 << 20,
        }
    }
}

/// What to try.
#[derive(Clone, Copy, Debug)]
pub struct Plan {
    pub seed: u64,
    /// Multiple of the short run.
    pub times: usize,
    /// The only mutant to try.
    pub only: Option<usize>,
    /// Number of threads; `None` for one per core.
    pub threads: Option<usize>,
}

thread_local! {
    /// While this thread judges, the panic of what it judges, if any.
    static PANIC: RefCell<Option<String>> = const { RefCell::new(None) };
}

/// Keeps panics of what is judged for the report instead of printing them.
pub fn silence_panics() {
    let usual = take_hook();
    set_hook(Box::new(move |panic| {
        let is_judging = PANIC.with_borrow_mut(|kept| {
            kept.as_mut()
                .map(|kept| *kept = panic.to_string())
                .is_some()
        });
        if !is_judging {
            usual(panic);
        }
    }));
}

/// The verdict on one mutant, or what is wrong with how it was judged. Also returns the bytes of
/// memory that it took.
pub fn judge(limits: Limits, check: impl FnOnce() -> Verdict) -> (Result<Verdict, String>, u64) {
    let begin = Instant::now();
    let mut verdict = Ok(Ok(()));
    let memory = measure(|| {
        PANIC.set(Some(String::new()));
        let judged = catch_unwind(AssertUnwindSafe(check));
        let panic = PANIC.take().unwrap_or_default();
        verdict = judged.map_err(|_| format!("panicked: {panic}"));
    });
    let seconds = begin.elapsed().as_secs_f64();
    let verdict = verdict.and_then(|verdict| {
        if begin.elapsed() > limits.time {
            return Err(format!("took {seconds:.1} s"));
        }
        if memory.bytes_max > limits.memory {
            return Err(format!("took {} MiB of memory", memory.bytes_max >> 20));
        }
        match &verdict {
            Err(Refused(message)) => presentable(message).map(|()| verdict),
            Ok(()) => Ok(verdict),
        }
    });
    (verdict, memory.bytes_max)
}

/// Checks a message: there is one, it is short, and it cannot control the terminal.
pub fn presentable(message: &str) -> Result<(), String> {
    if message.trim().is_empty() {
        return Err("an empty message".to_owned());
    }
    let (length, lines) = (message.chars().count(), message.lines().count());
    if length > LONGEST_MESSAGE || lines > MOST_LINES {
        return Err(format!(
            "a message of {length} characters in {lines} lines: {message:.300?}"
        ));
    }
    plain(message)
}

/// Checks that a text cannot control the terminal.
pub fn plain(text: &str) -> Result<(), String> {
    let drives = |character: char| {
        character != '\n' && character.is_control()
            || matches!(character, '\u{202a}'..='\u{202e}' | '\u{2066}'..='\u{2069}')
    };
    match text.find(drives) {
        Some(at) => Err(format!("a raw {:.1?} in {text:.1000?}", &text[at..])),
        None => Ok(()),
    }
}

/// Counts of what was tried.
#[derive(Default)]
struct Counts {
    /// Mutants tried and accepted by the change that made them.
    changes: BTreeMap<&'static str, [usize; 2]>,
    slowest: (Duration, usize),
    /// Most bytes of memory, and the mutant that took them.
    largest: (u64, usize),
    failures: Vec<(Option<usize>, String)>,
}

/// A mutant being judged, and since when.
type Slot = Mutex<Option<(usize, Instant)>>;

fn lock<T>(mutex: &Mutex<T>) -> MutexGuard<'_, T> {
    mutex
        .lock()
        .unwrap_or_else(|poisoned| poisoned.into_inner())
}

/// Attacks a target, prints what was tried, and returns the number of failures.
pub fn attack(target: &dyn Target, plan: &Plan) -> usize {
    let begin = Instant::now();
    let total = target.count() * plan.times;
    let (first, end) = plan.only.map_or((0, total), |only| (only, only + 1));
    let next = AtomicUsize::new(first);
    let counts = Mutex::new(Counts::default());
    let done = AtomicBool::new(false);
    if plan.only.is_none() {
        judge_originals(target, &counts);
        judge_refusals(target, &counts);
    }
    let threads = plan
        .threads
        .or_else(|| thread::available_parallelism().ok().map(usize::from))
        .unwrap_or(1);
    let slots: Vec<Slot> = (0..threads).map(|_| Mutex::new(None)).collect();
    thread::scope(|scope| {
        let watch = scope.spawn(|| stop_hanging(target, plan, &slots, &done));
        let workers: Vec<_> = slots
            .iter()
            .enumerate()
            .map(|(worker, slot)| {
                let (next, counts) = (&next, &counts);
                scope.spawn(move || {
                    let running = Running::new(target, plan, worker);
                    loop {
                        let number = next.fetch_add(1, Ordering::Relaxed);
                        if number >= end {
                            break;
                        }
                        running.note(number);
                        *lock(slot) = Some((number, Instant::now()));
                        judge_mutant(target, plan, number, counts);
                        *lock(slot) = None;
                    }
                    running.end();
                })
            })
            .collect();
        let ends: Vec<_> = workers.into_iter().map(|worker| worker.join()).collect();
        done.store(true, Ordering::Relaxed);
        watch.thread().unpark();
        ends.into_iter()
            .for_each(|end| end.expect("what is judged panics only where that is caught"));
    });
    let mut counts = counts
        .into_inner()
        .unwrap_or_else(|poisoned| poisoned.into_inner());
    if plan.only.is_none() {
        let vacuous = vacuous(target, &counts);
        counts
            .failures
            .extend(vacuous.into_iter().map(|problem| (None, problem)));
    }
    counts.failures.sort();
    report(target, plan, &counts, begin.elapsed());
    counts.failures.len()
}

/// Where files of the attack are saved.
fn directory() -> PathBuf {
    Path::new(env!("CARGO_TARGET_TMPDIR")).join("attack")
}

/// A file with the number of the mutant being judged. It remains if the attack itself dies: a stack
/// that overflows cannot be caught.
struct Running {
    path: PathBuf,
    file: File,
}

impl Running {
    fn new(target: &dyn Target, plan: &Plan, worker: usize) -> Self {
        let path = directory().join(format!("running-{}-{}-{worker}", target.name(), plan.seed));
        fs::create_dir_all(directory()).expect("cargo has made the directory above");
        Self {
            file: File::create(&path).expect("the directory can be written to"),
            path,
        }
    }

    fn note(&self, number: usize) {
        self.file
            .write_all_at(format!("{number:12}\n").as_bytes(), 0)
            .expect("a short file can be written");
    }

    fn end(self) {
        fs::remove_file(self.path).expect("it was written here");
    }
}

/// The generator of a mutant: the same whatever was tried before.
fn random(target: &dyn Target, plan: &Plan, number: usize) -> Rng {
    let name = target.name().bytes().fold(plan.seed, |hash, byte| {
        hash.wrapping_mul(0x0100_0000_01b3) ^ u64::from(byte)
    });
    Rng::with_seed(Rng::with_seed(name).u64(..) ^ number as u64)
}

fn judge_originals(target: &dyn Target, counts: &Mutex<Counts>) {
    for (number, original) in target.originals().iter().enumerate() {
        let problem = match judge(target.limits().reading(original), || {
            target.check(original, &mut Rng::with_seed(0))
        })
        .0
        {
            Ok(Ok(())) => continue,
            Ok(Err(Refused(message))) => format!("is refused: {message}"),
            Err(problem) => problem,
        };
        lock(counts)
            .failures
            .push((None, format!("the valid files number {number}: {problem}")));
    }
}

fn judge_refusals(target: &dyn Target, counts: &Mutex<Counts>) {
    for (mutant, expected) in target.refusals() {
        let problem = match judge(target.limits().reading(&mutant), || {
            target.check(&mutant, &mut Rng::with_seed(0))
        })
        .0
        {
            Ok(Err(Refused(message))) if message.contains(expected) => continue,
            Ok(Err(Refused(message))) => {
                format!("is refused without a word on {expected}: {message}")
            }
            Ok(Ok(())) => "is accepted".to_owned(),
            Err(problem) => problem,
        };
        lock(counts)
            .failures
            .push((None, format!("`{}` {problem}", mutant.change)));
    }
}

fn judge_mutant(target: &dyn Target, plan: &Plan, number: usize, counts: &Mutex<Counts>) {
    let mut random = random(target, plan, number);
    let begin = Instant::now();
    let mutant = target.mutant(&mut random);
    let (verdict, memory) = judge(target.limits().reading(&mutant), || {
        target.check(&mutant, &mut random)
    });
    let time = begin.elapsed();
    let mut counts = lock(counts);
    let [tried, accepted] = counts.changes.entry(mutant.change).or_default();
    *tried += 1;
    *accepted += usize::from(verdict == Ok(Ok(())));
    counts.slowest = counts.slowest.max((time, number));
    counts.largest = counts.largest.max((memory, number));
    if plan.only.is_some() {
        println!("{verdict:#?}");
        show_mutant(target, plan, number);
    }
    if let Err(problem) = verdict {
        counts.failures.push((Some(number), problem));
    }
}

/// Ends the program if a mutant takes far too long: its thread cannot be stopped.
fn stop_hanging(target: &dyn Target, plan: &Plan, slots: &[Slot], done: &AtomicBool) {
    let limit = 3 * target.limits().time;
    while !done.load(Ordering::Relaxed) {
        thread::park_timeout(Duration::from_millis(200));
        let hanging = slots
            .iter()
            .filter_map(|slot| *lock(slot))
            .find(|(_, begin)| begin.elapsed() > limit);
        if let Some((number, _)) = hanging {
            show_failure(
                target,
                plan,
                Some(number),
                &format!("has not ended after {} s", limit.as_secs()),
            );
            process::exit(1);
        }
    }
}

/// What was not tried, so that the attack proves nothing.
fn vacuous(target: &dyn Target, counts: &Counts) -> Vec<String> {
    let [tried, accepted] = totals(counts);
    let refused = tried
        - accepted
        - counts
            .failures
            .iter()
            .filter(|(number, _)| number.is_some())
            .count();
    let done = [("accepted", accepted), ("refused", refused)]
        .into_iter()
        .chain(target.further());
    done.filter(|(_, count)| *count == 0)
        .map(|(what, _)| format!("proves nothing: no mutant was {what}"))
        .collect()
}

fn totals(counts: &Counts) -> [usize; 2] {
    counts
        .changes
        .values()
        .fold([0; 2], |sum, one| [sum[0] + one[0], sum[1] + one[1]])
}

fn report(target: &dyn Target, plan: &Plan, counts: &Counts, time: Duration) {
    let Counts {
        changes,
        slowest,
        largest,
        failures,
    } = counts;
    let [tried, accepted] = totals(counts);
    println!(
        "{}: {tried} mutants in {:.1} s, {accepted} accepted; number {} took longest ({:.0} ms), number {} most memory ({} KiB)",
        target.name(),
        time.as_secs_f64(),
        slowest.1,
        1e3 * slowest.0.as_secs_f64(),
        largest.1,
        largest.0 >> 10,
    );
    for (what, count) in target.further() {
        println!("    {what}: {count}");
    }
    let changes: Vec<String> = changes
        .iter()
        .map(|(change, [tried, accepted])| format!("{change} {accepted}/{tried}"))
        .collect();
    println!("    accepted/tried by change: {}", changes.join(", "));
    // One of each kind: failures that begin alike have the same cause more often than not.
    let mut kinds = BTreeMap::new();
    for (number, problem) in failures {
        kinds
            .entry(
                problem
                    .chars()
                    .filter(char::is_ascii_alphabetic)
                    .take(80)
                    .collect::<String>(),
            )
            .or_insert((number, problem));
    }
    for (number, problem) in kinds.values().take(MOST_SHOWN) {
        show_failure(target, plan, **number, problem);
    }
    if !failures.is_empty() {
        println!("    {} failures in all", failures.len());
    }
}

/// Prints a failure and its mutant.
fn show_failure(target: &dyn Target, plan: &Plan, number: Option<usize>, problem: &str) {
    println!("FAILURE of {}: {problem}", target.name());
    if let Some(number) = number {
        show_mutant(target, plan, number);
    }
}

/// Saves the files of a mutant, and says how to repeat it.
fn show_mutant(target: &dyn Target, plan: &Plan, number: usize) {
    let (name, seed) = (target.name(), plan.seed);
    let mutant = target.mutant(&mut random(target, plan, number));
    let directory = directory().join(format!("{name}-{seed}-{number}"));
    let saved = save(&directory, &mutant).map_or_else(
        |error| error.to_string(),
        |()| directory.display().to_string(),
    );
    let Mutant {
        change,
        before,
        call,
        redirection,
        ..
    } = mutant;
    println!("    made by `{change}`; call: {before} {call:?} {redirection}; files: {saved}");
    println!(
        "    repeat: cargo test -p bristle-cli --test attack -- {name} --seed {seed} --mutant {number}"
    );
}

fn save(directory: &Path, mutant: &Mutant) -> io::Result<()> {
    for (name, content) in &mutant.files {
        let path = directory.join(name);
        fs::create_dir_all(path.parent().unwrap_or(directory))?;
        fs::write(path, content)?;
    }
    Ok(())
}
