#include "daemon/teach/teacher.hpp"

#include <algorithm>
#include <chrono>
#include <memory>
#include <new>
#include <utility>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <spdlog/spdlog.h>

#include "daemon/pipeline/messages.hpp"
#include "daemon/system/realtime.hpp"
#include "models/style/train/take_check.hpp"
#include "models/style/train/train.hpp"
#include "models/style/train/train_report.hpp"
#include "proto/clip/frames_clip.hpp"
#include "proto/frame/time.hpp"
#include "proto/text/clean.hpp"

namespace posed::teach {
namespace {

using Step = v1::Teaching;

constexpr const char* kThreadName = "posed-teach";
constexpr double kTrainRate_hz = 30.0;  // as `posed train style`
constexpr std::chrono::milliseconds kLookAtTap{50};
// So long after its end a walk waits for frames that are still on their way.
constexpr std::int64_t kLate_ns = kNanosPerSecond / 2;
constexpr const char* kUsual = "as usual";  // the group of the walks as usual

std::size_t at(Walk walk) { return static_cast<std::size_t>(walk); }

}  // namespace

// The walk that is being marked; the thread's own.
struct Teacher::Collected {
  std::uint64_t job = 0;  // 0: none
  Pupil pupil{};
  Walk walk = Walk::kNeutral;
  std::int64_t from_ns = 0, until_ns = 0;
  std::optional<clip::FramesClip> frames{};
  clip::FrameTimes times{};

  // Returns whether the frame is behind the end of the walk.
  bool add(const Frame& frame) {
    const Header& header = frame.header;
    if (header.stream != pupil.stream || header.arrival_ns < from_ns) return false;
    if (header.arrival_ns >= until_ns) return true;
    if (times.size() == kMaxWalkFrames || frame.skeleton != pupil.skeleton->id) return false;
    frames->add(frame);
    times.add(header);
    return false;
  }
  [[nodiscard]] style::TrainingClip clip() const {
    style::TrainingClip take{.clip = {}, .group = {}, .subject = "one person", .motion = "walk"};
    const std::string path = walk == Walk::kNeutral ? "the walk as usual" : "the walk in the style";
    auto clip = frames->finish(path, kTrainRate_hz, times.in_seconds());
    if (clip) take.clip = std::move(*clip);
    take.clip.path = path;
    return take;
  }
};

Teacher::Teacher(Keep keep, std::function<void()> call, Clock clock)
    : keep_(std::move(keep)),
      call_(std::move(call)),
      clock_(clock),
      tapped_(pipeline::kNoStream),
      thread_([this] { run(); }) {}

Teacher::~Teacher() {
  {
    const std::scoped_lock lock(mutex_);
    stop_ = true;
    ++job_;
  }
  changed_.notify_all();
  thread_.join();
}

RT_SAFE void Teacher::raw_frame(const Frame& frame) noexcept {
  if (frame.header.stream != tapped_.load(std::memory_order_relaxed)) return;
  if (!tap_.push(frame)) lost_.fetch_add(1, std::memory_order_relaxed);
}

v1::TaughtWalk& Teacher::words_of(Walk walk) {
  return walk == Walk::kNeutral ? *state_.mutable_neutral_walk() : *state_.mutable_style_walk();
}

bool Teacher::is_under_way() const {
  return state_.step() != Step::STEP_IDLE && state_.step() != Step::STEP_IN_USE;
}

void Teacher::forget_outcome() {
  state_.clear_problem();
  state_.clear_verdict();
  state_.clear_model();
  state_.clear_sequence();
  state_.clear_train_s();
}

Result<> Teacher::check_free() const {
  if (working_) return fail("what was cancelled is still ending; ask again in a moment");
  if (!is_under_way()) return {};
  return fail("stream " + state_.stream() +
              " is being taught just now; wait for its end, or cancel it where it was begun");
}

Result<> Teacher::mark(const Pupil& pupil, Walk walk, double seconds) {
  if (!(seconds >= kMinWalk_s && seconds <= kMaxWalk_s)) {
    return fail("a walk has 6 to 120 s; 20 are enough");
  }
  const std::scoped_lock lock(mutex_);
  TRY(check_free());
  const bool same = state_.stream() == pupil.name && pupil_.skeleton->id == pupil.skeleton->id;
  if (!same) {
    state_.Clear();
    walks_ = {};
  }
  state_.set_stream(pupil.name);
  state_.set_step(Step::STEP_MARKING);
  state_.set_style(walk == Walk::kStyle);
  forget_outcome();
  words_of(walk).Clear();
  walks_[at(walk)].reset();
  lost_ = 0;
  pupil_ = pupil;
  walk_ = walk;
  from_ns_ = clock_();
  until_ns_ = from_ns_ + static_cast<std::int64_t>(seconds * 1e9);
  ++job_;
  tapped_.store(pupil.stream, std::memory_order_relaxed);
  changed_.notify_all();
  return {};
}

Result<> Teacher::train(const std::string& stream, const std::string& name) {
  const std::scoped_lock lock(mutex_);
  TRY(check_free());
  for (const Walk walk : {Walk::kNeutral, Walk::kStyle}) {
    if (state_.stream() == stream && walks_[at(walk)]) continue;
    return fail(std::string("there is no good walk ") +
                (walk == Walk::kNeutral ? "as usual" : "in the style") + " of stream " +
                in_quotes(stream) + " yet; mark it first");
  }
  asked_ns_ = clock_();
  name_ = name;
  ++job_;
  forget_outcome();
  state_.set_step(Step::STEP_TRAINING);
  changed_.notify_all();
  return {};
}

Result<> Teacher::cancel(const std::string& stream) {
  const std::scoped_lock lock(mutex_);
  if (state_.stream() != stream)
    return fail("stream " + in_quotes(stream) + " is not being taught");
  if (!is_under_way()) return {};
  if (state_.step() == Step::STEP_STARTING && !model_) {
    return fail("the style is coming on just now; alpha = 0 or another model takes it off again");
  }
  model_.reset();
  finish(Step::STEP_IDLE, {});
  changed_.notify_all();
  return {};
}

v1::Teaching Teacher::state() const {
  const std::scoped_lock lock(mutex_);
  v1::Teaching state = state_;
  if (state.step() == Step::STEP_MARKING) {
    state.set_seconds_left(std::max(0.0, seconds(until_ns_ - clock_())));
  }
  return state;
}

// Call it with mutex_ held. What is under way is over.
void Teacher::finish(v1::Teaching::Step step, const std::string& problem) {
  ++job_;
  tapped_.store(pipeline::kNoStream, std::memory_order_relaxed);
  state_.set_step(step);
  state_.set_problem(clean(problem));
}

std::optional<TaughtModel> Teacher::take_model() {
  const std::scoped_lock lock(mutex_);
  return std::exchange(model_, std::nullopt);
}

void Teacher::started(std::uint64_t sequence) {
  const std::scoped_lock lock(mutex_);
  if (state_.step() != Step::STEP_STARTING) return;
  state_.set_sequence(sequence);
  state_.set_train_s(seconds(clock_() - asked_ns_));
  finish(Step::STEP_IN_USE, {});
}

void Teacher::not_started(const std::string& why) {
  const std::scoped_lock lock(mutex_);
  if (state_.step() == Step::STEP_STARTING) finish(Step::STEP_IDLE, why);
}

void Teacher::run() {
  system::name_thread(kThreadName);
  system::give_way();
  Collected collected;
  Lock lock(mutex_);
  while (!stop_) {
    try {
      if (state_.step() == Step::STEP_MARKING) {
        collect(lock, collected);
      } else if (state_.step() == Step::STEP_TRAINING) {
        train_now(lock);
      } else {
        changed_.wait(lock);
      }
    } catch (const std::bad_alloc&) {
      collected = {};
      if (!lock.owns_lock()) lock.lock();
      working_ = false;
      finish(Step::STEP_IDLE, "there is too little memory for this; mark shorter walks");
    }
  }
}

// A turn of collecting the walk.
void Teacher::collect(Lock& lock, Collected& collected) {
  if (collected.job != job_) {
    collected = {.job = job_,
                 .pupil = pupil_,
                 .walk = walk_,
                 .from_ns = from_ns_,
                 .until_ns = until_ns_,
                 .frames = clip::FramesClip(pupil_.skeleton)};
  }
  lock.unlock();
  bool over = clock_() >= collected.until_ns + kLate_ns;
  while (tap_.consume([&](const Frame& frame) { over = collected.add(frame) || over; })) {
  }
  if (over) return check(lock, collected);
  lock.lock();
  if (!stop_ && collected.job == job_) changed_.wait_for(lock, kLookAtTap);
}

// The walk is over; called without the lock, returns with it.
void Teacher::check(Lock& lock, Collected& collected) {
  lock.lock();
  if (collected.job != job_) return;
  tapped_.store(pipeline::kNoStream, std::memory_order_relaxed);
  state_.set_step(Step::STEP_CHECKING);
  working_ = true;
  lock.unlock();
  style::TrainingClip take = collected.clip();
  const style::TakeCheck checked = style::check_take(take, kTrainRate_hz);
  lock.lock();
  working_ = false;
  if (collected.job != job_) return;
  v1::TaughtWalk& words = words_of(collected.walk);
  words.set_good(checked.good());
  std::string sentence = clean(checked.sentence());
  if (const std::uint64_t lost = lost_; lost > 0) {
    sentence += fmt::format("; {} frames came faster than this computer could keep them", lost);
  }
  words.set_sentence(sentence);
  const std::string path = take.clip.path;
  if (checked.good()) {
    walks_[at(collected.walk)] = std::make_shared<const style::TrainingClip>(std::move(take));
  }
  finish(Step::STEP_IDLE, {});
  lock.unlock();
  spdlog::info("{}: {}: {}", collected.pupil.name, path, sentence);
  collected = {};
  lock.lock();
}

void Teacher::train_now(Lock& lock) {
  const std::uint64_t job = job_;
  const auto walks = walks_;
  const std::string name = name_;
  const std::string stream = state_.stream();
  working_ = true;
  lock.unlock();
  std::vector<style::TrainingClip> clips;
  clips.reserve(walks.size());
  for (const auto& walk : walks) clips.push_back(*walk);
  clips.front().group = kUsual;
  clips.back().group = name;
  style::TrainingVerdict verdict;
  style::TrainOptions options;
  options.target = name;
  options.dataset.space = style::usual_space(clips);
  options.dataset.rate_hz = kTrainRate_hz;
  options.dataset.progress = [&](std::string_view, double) { return job_ == job; };
  options.look = [&](const style::Findings& learnt) { verdict = learnt.verdict; };
  // Without FixedProducts, which are for the whole process: here others compute meanwhile. The log
  // keeps the model itself, so that nothing depends on making the same bits again.
  const auto model = style::train_style(clips, options);
  std::string problem;
  std::string bytes;
  if (!model) {
    problem = model.error().text();
  } else if (!verdict.usable) {
    problem = verdict.sentence;
  } else {
    bytes = style::serialize_model(*model);
  }
  Result<std::string> file = std::string();
  if (!bytes.empty() && job_ == job) file = keep_(name, bytes);
  if (!file) problem = file.error().text();
  lock.lock();
  working_ = false;
  if (job_ != job) return;
  if (!problem.empty()) return finish(Step::STEP_IDLE, problem);
  state_.set_verdict(clean(verdict.sentence));
  state_.set_model(*file);
  state_.set_step(Step::STEP_STARTING);
  model_ = {.stream = stream, .file = *file, .bytes = std::move(bytes)};
  call_();
  lock.unlock();
  spdlog::info("{}: learnt style {}: {}", stream, *file, clean(verdict.sentence));
  lock.lock();
}

}  // namespace posed::teach
