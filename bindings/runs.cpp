// Many closed loops at once, on threads of the core that never need the interpreter lock.
#include <nanobind/stl/shared_ptr.h>

#include <algorithm>
#include <atomic>
#include <chrono>
#include <cmath>
#include <condition_variable>
#include <deque>
#include <mutex>
#include <thread>

#include "bind_struct.hpp"
#include "simulation.hpp"

namespace bound {

namespace {

/// What the state of a run must stay within. A run that leaves it ends there.
struct Within {
  double omega_m;  // [rad/s]
  double i;        // of a phase [A]
  double u_dc;     // [V]
  double steps;    // of the whole run, at its pace after `judged` of them
  double judged;
  SRM_FIELDS(omega_m, i, u_dc, steps, judged)

  bool holds(const AnySimulation& loop, double t, double end) const {
    const auto& [i_ph, omega, theta, u] = loop.state();
    bool kept = std::isfinite(theta) && std::abs(omega) <= omega_m && u <= u_dc;
    for (const double i_k : i_ph) kept = kept && i_k <= i;
    const double taken = double(loop.steps());
    return kept && !(taken > judged && taken * end > steps * t);
  }
};

/// One run: what it needs, then what it found.
struct Job {
  long tag;
  std::shared_ptr<AnySimulation> loop;
  double end;
  Within within;
  double t = 0, wall = 0;         // reached; spent [s]
  std::vector<double> periods{};  // rows
};

/// A few threads that take runs in the order given. Finished ones wait until they are asked for.
class Runs {
 public:
  explicit Runs(int threads) {
    if (threads < 1) throw std::invalid_argument("need at least one thread");
    for (int n = 0; n < threads; ++n) threads_.emplace_back([this] { work(); });
  }
  Runs(const Runs&) = delete;
  Runs& operator=(const Runs&) = delete;
  ~Runs() { close(); }

  void add(long tag, std::shared_ptr<AnySimulation> loop, double end, const Within& within) {
    {
      const std::lock_guard lock(mutex_);
      if (closed_) throw std::invalid_argument("the threads have ended");
      left_.push_back({tag, std::move(loop), end, within});
      ++unfinished_;
    }
    work_.notify_one();
  }

  /// Runs that have been added and not been taken.
  int unfinished() const { return unfinished_; }

  /// A run that has ended: its tag, the time reached and spent [s], its period rows. Waits for one.
  nb::tuple take() {
    Job job;
    for (bool found = false; !found;) {
      {
        const nb::gil_scoped_release unlocked;
        found = wait_for(job);
      }
      if (!found && PyErr_CheckSignals() != 0) throw nb::python_error();
    }
    --unfinished_;
    const auto columns = std::size_t(job.loop->period_columns());
    const std::size_t rows = job.periods.size() / columns;
    return nb::make_tuple(job.tag, job.t, job.wall, numpy(std::move(job.periods), {rows, columns}));
  }

  /// Ends the threads within a slice of a run. What has not been taken is lost. Called with the
  /// interpreter lock held.
  void close() {
    {
      const std::lock_guard lock(mutex_);
      closed_ = true;
    }
    work_.notify_all();
    {
      const nb::gil_scoped_release unlocked;
      for (std::thread& thread : threads_) thread.join();
    }
    threads_.clear();
    left_.clear();
    done_.clear();
  }

 private:
  bool wait_for(Job& job) {
    std::unique_lock lock(mutex_);
    if (unfinished_ == 0) throw std::invalid_argument("no run is left to take");
    if (!finished_.wait_for(lock, std::chrono::milliseconds(50), [this] { return !done_.empty(); }))
      return false;
    job = std::move(done_.front());
    done_.pop_front();
    return true;
  }

  void work() {
    for (;;) {
      std::unique_lock lock(mutex_);
      work_.wait(lock, [this] { return closed_ || !left_.empty(); });
      if (closed_) return;
      Job job = std::move(left_.front());
      left_.pop_front();
      lock.unlock();
      run(job);
      lock.lock();
      done_.push_back(std::move(job));
      lock.unlock();
      finished_.notify_one();
    }
  }

  void run(Job& job) const {
    const auto start = std::chrono::steady_clock::now();
    const auto keep = [&job] {
      const std::vector<double> rows = job.loop->periods();
      job.periods.insert(job.periods.end(), rows.begin(), rows.end());
    };
    job.loop->close_period();
    do {
      job.t = job.loop->advance(job.end);
      keep();
    } while (job.t < job.end && !closed_ && job.within.holds(*job.loop, job.t, job.end));
    job.loop->close_period();
    keep();
    job.wall = std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count();
  }

  std::mutex mutex_;
  std::condition_variable work_, finished_;
  std::deque<Job> left_, done_;
  std::atomic<int> unfinished_ = 0;
  std::atomic<bool> closed_ = false;
  std::vector<std::thread> threads_;
};

}  // namespace

void bind_runs(nb::module_& m) {
  bind_struct<Within>(m, "Within", "What a run must stay within: speed, current, voltage, steps.");
  nb::class_<Runs>(
      m, "Runs",
      "Threads that run closed loops to their ends. A control law in Python makes them "
      "wait for the interpreter lock at every sample.")
      .def(nb::init<int>(), nb::arg("threads"))
      .def("add", &Runs::add, nb::arg("tag"), nb::arg("loop"), nb::arg("end"), nb::arg("within"),
           "One more run, to its end [s]. The loop keeps no waveforms and is not touched until it "
           "has been taken.")
      .def_prop_ro("unfinished", &Runs::unfinished, "Runs added and not taken.")
      .def(
          "take", &Runs::take,
          nb::sig("def take(self) -> tuple[int, float, float, "
                  "typing.Annotated[numpy.typing.NDArray, dict(dtype='float64')]]"),
          "Waits for a run that has ended: its tag, the time reached [s], the wall time spent [s], "
          "and its period rows.")
      .def("close", &Runs::close, "Ends the threads; what has not been taken is lost.");
}

}  // namespace bound
