//! The thread that makes the compacted set.

use super::join::join;
use crate::world::live::sah::SahMeter;
use crate::world::{BuildOptions, DerivedWorld, LeafSnapshot};
use orthant_resident::world::{ArenaLens, MutationBatch};
use orthant_world::Palette;
use std::sync::mpsc::{Receiver, Sender, SyncSender, TryRecvError, channel, sync_channel};
use std::time::{Duration, Instant};

/// Batches that wait for the frame loop, at most: the thread is ahead of it by little memory.
const AHEAD: usize = 4;

/// A compacted set, complete.
pub struct Built {
    /// It equals the set that was the snapshot's, until it follows what changed since.
    pub derived: DerivedWorld,
    /// The cost of its tree.
    pub sah: SahMeter,
}

/// What the thread says, in this order: the build's end, every batch that fills an empty set, the set itself; or that it failed.
pub enum Message {
    /// The build is done.
    Planned {
        /// What it took.
        time: Duration,
        /// What bounds are relative to.
        origin: [i64; 4],
        /// The lengths of the arenas.
        lens: ArenaLens,
        /// The leaves that joining saved.
        joined: usize,
    },
    /// The next part of the set.
    Batch(MutationBatch),
    /// All parts were sent.
    Done(Box<Built>),
    /// There is no such set.
    Failed(String),
}

/// The thread ended before it had said everything.
pub struct Gone;

/// What is to be dropped.
type Waste = Box<dyn Send>;

/// A build on a thread of its own. It ends by itself when this is dropped.
pub struct Worker {
    receiver: Receiver<Message>,
    waste: Sender<Waste>,
}

/// What a build is made of.
pub struct Job {
    pub snapshot: LeafSnapshot,
    pub palette: Palette,
    pub options: BuildOptions,
    /// Bytes of a batch.
    pub slice: u64,
}

impl Worker {
    /// Begins.
    ///
    /// # Errors
    /// If the system gives no thread.
    pub fn spawn(job: Job) -> std::io::Result<Self> {
        let (sender, receiver) = sync_channel(AHEAD);
        let (waste, to_drop) = channel::<Waste>();
        let run = move || {
            work(job, &sender);
            drop(sender);
            to_drop.into_iter().for_each(drop);
        };
        std::thread::Builder::new().name("orthant-compaction".into()).spawn(run)?;
        Ok(Self { receiver, waste })
    }

    /// Drops what is large on the thread: a frame has no time to free a million leaves.
    pub fn discard(&self, waste: impl Send + 'static) {
        // A thread that has panicked leaves it to this one.
        drop(self.waste.send(Box::new(waste)));
    }

    /// What it says next, if it has said anything; an error if it ended without a word. Never waits.
    pub fn news(&self) -> Result<Option<Message>, Gone> {
        match self.receiver.try_recv() {
            Ok(message) => Ok(Some(message)),
            Err(TryRecvError::Empty) => Ok(None),
            Err(TryRecvError::Disconnected) => Err(Gone),
        }
    }
}

/// Nobody listens any more when sending fails: the compaction was given up.
fn work(job: Job, sender: &SyncSender<Message>) {
    let start = Instant::now();
    let before = job.snapshot.len();
    let leaves = join(job.snapshot.leaves().collect());
    let joined = before - leaves.len();
    // Pages that the active set has written since live only here.
    drop(job.snapshot);
    let build = || DerivedWorld::from_leaves(leaves, &job.palette, &job.options);
    // A pool of its own: the frame loop's threads have other work.
    let built = match rayon::ThreadPoolBuilder::new().num_threads(1).build() {
        Ok(pool) => pool.install(build),
        Err(error) => return drop(sender.send(Message::Failed(error.to_string()))),
    };
    let derived = match built {
        Ok(derived) => derived,
        Err(error) => return drop(sender.send(Message::Failed(error.to_string()))),
    };
    let sah = SahMeter::new(derived.mirror());
    let planned =
        Message::Planned { time: start.elapsed(), origin: derived.origin(), lens: derived.mirror().lens(), joined };
    if sender.send(planned).is_err() {
        return;
    }
    for batch in derived.load_batches(job.slice) {
        if sender.send(Message::Batch(batch)).is_err() {
            return;
        }
    }
    drop(sender.send(Message::Done(Box::new(Built { derived, sah }))));
}
