//! Between the window and a thread that works for it. In flows what is wanted, of which only the last counts; out flow news.

use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Condvar, Mutex, MutexGuard, PoisonError};
use std::thread::JoinHandle;

/// What both sides see.
struct Desk<W, N> {
    state: Mutex<State<W, N>>,
    arrived: Condvar,
    interrupt: Arc<AtomicBool>,
    /// Called whenever there is news.
    wake: Box<dyn Fn() + Send + Sync>,
}

struct State<W, N> {
    wanted: Option<W>,
    news: Vec<N>,
    closed: bool,
}

impl<W, N> Desk<W, N> {
    fn state(&self) -> MutexGuard<'_, State<W, N>> {
        self.state.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// What a thread has to say.
pub(super) trait News {
    /// Whether nobody needs to hear of `before` any more.
    fn replaces(&self, before: &Self) -> bool;
}

/// The thread's side.
pub(super) struct Orders<W, N>(Arc<Desk<W, N>>);

impl<W, N: News> Orders<W, N> {
    /// Waits for what is wanted; `None` at the end.
    pub(super) fn next(&self) -> Option<W> {
        let mut state = self.0.state();
        loop {
            if state.closed {
                return None;
            }
            if let Some(wanted) = state.wanted.take() {
                self.0.interrupt.store(false, Ordering::Relaxed);
                return Some(wanted);
            }
            state = self.0.arrived.wait(state).unwrap_or_else(PoisonError::into_inner);
        }
    }

    /// Whether something else is wanted already.
    pub(super) fn is_late(&self) -> bool {
        self.0.interrupt.load(Ordering::Relaxed)
    }

    /// What is wanted next, where it is like that.
    pub(super) fn next_if(&self, is_like: impl FnOnce(&W) -> bool) -> Option<W> {
        let mut state = self.0.state();
        let next = state.wanted.take_if(|wanted| is_like(wanted));
        if next.is_some() && !state.closed {
            self.0.interrupt.store(false, Ordering::Relaxed);
        }
        next
    }

    /// Set while something else is wanted already.
    pub(super) fn interrupt(&self) -> Arc<AtomicBool> {
        self.0.interrupt.clone()
    }

    /// Tells something, in the place of what it makes idle.
    pub(super) fn tell(&self, news: N) {
        let mut state = self.0.state();
        state.news.retain(|before| !news.replaces(before));
        state.news.push(news);
        drop(state);
        (self.0.wake)();
    }
}

/// The window's side; the thread ends when it is dropped.
pub(super) struct Hand<W, N> {
    desk: Arc<Desk<W, N>>,
    thread: Option<JoinHandle<()>>,
}

impl<W: Send + 'static, N: Send + 'static> Hand<W, N> {
    /// A thread that does `work`. `wake` is called whenever there is news.
    pub(super) fn new(
        wake: impl Fn() + Send + Sync + 'static,
        work: impl FnOnce(Orders<W, N>) + Send + 'static,
    ) -> Self {
        let state = State { wanted: None, news: Vec::new(), closed: false };
        let desk = Arc::new(Desk {
            state: Mutex::new(state),
            arrived: Condvar::new(),
            interrupt: Arc::default(),
            wake: Box::new(wake),
        });
        let orders = Orders(desk.clone());
        Self { desk, thread: Some(std::thread::spawn(move || work(orders))) }
    }

    /// Asks for this next, in the place of anything that waits.
    pub(super) fn want(&self, wanted: W) {
        let mut state = self.desk.state();
        self.desk.interrupt.store(true, Ordering::Relaxed);
        state.wanted = Some(wanted);
        self.desk.arrived.notify_all();
    }

    /// Ends what is under way; what waits is forgotten.
    pub(super) fn stop(&self) {
        let mut state = self.desk.state();
        state.wanted = None;
        self.desk.interrupt.store(true, Ordering::Relaxed);
    }

    /// Whether the thread has ended before its time.
    pub(super) fn is_over(&self) -> bool {
        self.thread.as_ref().is_none_or(JoinHandle::is_finished)
    }

    /// What there is to hear since the last time.
    pub(super) fn news(&self) -> Vec<N> {
        std::mem::take(&mut self.desk.state().news)
    }
}

impl<W, N> Drop for Hand<W, N> {
    fn drop(&mut self) {
        self.desk.state().closed = true;
        self.desk.interrupt.store(true, Ordering::Relaxed);
        self.desk.arrived.notify_all();
        if let Some(thread) = self.thread.take() {
            // One that panicked has said so.
            let _ = thread.join();
        }
    }
}

#[cfg(test)]
mod tests {
    use std::sync::mpsc::channel;

    use super::*;

    impl News for (u32, bool) {
        fn replaces(&self, before: &Self) -> bool {
            self.0 == before.0
        }
    }

    #[test]
    fn the_last_order_counts_and_ends_what_is_under_way() {
        let (woken, wakes) = channel();
        let woken = Mutex::new(woken);
        let wake = move || woken.lock().expect("a channel").send(()).expect("a listener");
        let hand = Hand::new(wake, |orders: Orders<u32, (u32, bool)>| {
            while let Some(order) = orders.next() {
                orders.tell((order, orders.is_late()));
                while order == 1 && !orders.is_late() {
                    std::thread::yield_now();
                }
                while let Some(more) = orders.next_if(|more| *more == 10 * order) {
                    orders.tell((more, orders.is_late()));
                }
            }
        });
        let heard = || {
            wakes.recv().expect("news");
            hand.news()
        };
        hand.want(2);
        assert_eq!(heard(), [(2, false)]);
        hand.want(1);
        assert_eq!(heard(), [(1, false)]);
        hand.want(10);
        assert_eq!(heard(), [(10, false)], "more of the same, which is not late itself");
        hand.want(3);
        assert_eq!(heard(), [(3, false)]);
        drop(hand);
    }
}
