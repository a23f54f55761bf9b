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
#include "proto/clip/hand_clip.hpp"
#include "proto/frame/hand_skeleton.hpp"
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
// A walk is judged while it is walked: each second, with a tenth of the time at most, and no long
// one, for the ring fills meanwhile.
constexpr std::int64_t kTellEach_ns = kNanosPerSecond;
constexpr std::int64_t kTellShare = 10;
constexpr std::size_t kMaxTold = 4800;      // frames
constexpr const char* kUsual = "as usual";  // the group of the walks as usual

std::size_t at(Walk walk) { return static_cast<std::size_t>(walk); }

}  // namespace

// The walk or show that is being marked; the thread's own.
struct Teacher::Collected {
  std::uint64_t job = 0;  // 0: none
  Pupil pupil{};
  Marked marked{};
  std::optional<clip::FramesClip> frames{};  // of a walk
  clip::HandClip hand{};                     // of a show
  clip::FrameTimes times{};
  std::size_t seen = 0, each = 1;          // frames that came; of so many one is kept
  std::int64_t first_ns = 0, last_ns = 0;  // arrivals
  std::int64_t tell_ns = 0;                // when it is judged next

  // Returns whether the frame is behind the end.
  bool add(const Frame& frame) {
    const Header& header = frame.header;
    if (header.stream != pupil.stream || header.arrival_ns < marked.from_ns) return false;
    if (header.arrival_ns >= marked.until_ns) return true;
    if (frame.skeleton != pupil.skeleton->id) return false;
    last_ns = header.arrival_ns;
    if (first_ns == 0) first_ns = last_ns;
    if (seen++ % each != 0) return false;
    if (marked.label.empty()) {
      frames->add(frame);
    } else {
      hand.angles.push_back(hand_angles(frame));
    }
    times.add(header);
    thin();
    return false;
  }
  // A fast stream would fill the memory with what training does not look at. What is kept stays
  // evenly spaced.
  void thin() {
    // What waited somewhere may come all at once.
    const double span_s = seconds(last_ns - first_ns);
    const double most = span_s < 1.0 ? double{kTapSlots} : kMaxKeptRate_hz * span_s;
    if (static_cast<double>(times.size()) <= most) return;
    frames->halve();
    clip::drop_every_second(hand.angles);
    times.halve();
    each *= 2;
  }
  [[nodiscard]] style::TakeCheck judge(style::TrainingClip& take, std::int64_t until_ns) const {
    const std::int64_t silent_ns = std::max(first_ns - marked.from_ns, until_ns - last_ns);
    return style::check_take(take, kTrainRate_hz, seconds(silent_ns));
  }
  [[nodiscard]] style::TrainingClip clip() const {
    style::TrainingClip take{.clip = {}, .group = {}, .subject = pupil.name, .motion = "walk"};
    const std::string path = what();
    auto clip = frames->finish(path, kTrainRate_hz, times.in_seconds());
    if (clip) take.clip = std::move(*clip);
    take.clip.path = path;
    return take;
  }
  [[nodiscard]] std::string what() const {
    if (!marked.label.empty()) return "the sign " + clean(marked.label);
    return marked.walk == Walk::kNeutral ? "the walk as usual" : "the walk in the style";
  }
};

struct Teacher::Outcome {
  std::string bytes{};    // of the model's file; empty: there is none
  std::string verdict{};  // of the training
  std::string problem{};  // why there is no model
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

Result<> Teacher::make_room(const Pupil& pupil) {
  TRY(check_free());
  if (is_known(pupil)) return {};
  const std::size_t walks = walks_[0].size() + walks_[1].size();
  const std::size_t marked = walks + signs_.signs().size();
  const bool other = state_.stream() != pupil.name;  // else nothing of it fits the new skeleton
  if (other && marked > 0 && state_.step() != Step::STEP_IN_USE) {
    return fail(fmt::format(
        "the lesson of stream {} is not finished: {} of its {} {} kept; learn"
        " from them, or begin anew",
        state_.stream(), marked, walks > 0 ? "walks" : "signs", marked == 1 ? "is" : "are"));
  }
  forget_all();
  return {};
}

bool Teacher::is_known(const Pupil& pupil) const {
  return state_.stream() == pupil.name && pupil_.skeleton->id == pupil.skeleton->id;
}

// Call it with mutex_ held, and nothing under way.
void Teacher::begin(const Pupil& pupil, Marked marked, double seconds) {
  state_.set_stream(pupil.name);
  state_.set_step(Step::STEP_MARKING);
  state_.set_style(marked.label.empty() && marked.walk == Walk::kStyle);
  state_.set_label(marked.label);
  forget_outcome();
  lost_ = 0;
  pupil_ = pupil;
  marked_ = std::move(marked);
  marked_.from_ns = clock_();
  marked_.until_ns = marked_.from_ns + static_cast<std::int64_t>(seconds * 1e9);
  ++job_;
  tapped_.store(pupil.stream, std::memory_order_relaxed);
  changed_.notify_all();
}

Result<> Teacher::mark(const Pupil& pupil, Walk walk, double seconds, bool more) {
  if (!(seconds >= kMinWalk_s && seconds <= kMaxWalk_s)) {
    return fail("a walk has 6 to 120 s; 20 are enough");
  }
  const std::scoped_lock lock(mutex_);
  TRY(make_room(pupil));
  const auto& walks = walks_[at(walk)];
  std::size_t numbers = 0;
  for (const auto& kept : walks) numbers += static_cast<std::size_t>(kept->clip.channels.size());
  if (more && (walks.size() >= kMaxWalks || numbers > kMaxKeptNumbers)) {
    return fail(fmt::format("{} walks of this kind are enough", walks.size()));
  }
  words_of(walk).Clear();
  words_of(walk).set_takes(static_cast<std::uint32_t>(walks.size()));
  begin(pupil, {.walk = walk, .more = more}, seconds);
  return {};
}

Result<> Teacher::show(const Pupil& pupil, const std::string& label, double seconds) {
  if (!hand_side(*pupil.skeleton)) {
    return fail("stream " + pupil.name + " is no hand; signs are taught to hands");
  }
  if (!(seconds >= kMinShow_s && seconds <= kMaxShow_s)) {
    return fail("a show has 3 to 15 s; 5 are enough");
  }
  const std::scoped_lock lock(mutex_);
  TRY(make_room(pupil));
  TRY(signs_.check_label(label));
  state_.mutable_show()->Clear();
  begin(pupil, {.label = label}, seconds);
  return {};
}

Result<> Teacher::forget(const std::string& stream, const std::string& label) {
  const std::scoped_lock lock(mutex_);
  TRY(check_free());
  if (label.empty() && state_.stream() == stream) {
    forget_all();
    return {};
  }
  if (state_.stream() != stream || !signs_.signs().contains(label)) {
    return fail("no sign " + in_quotes(label) + " was shown to stream " + in_quotes(stream));
  }
  signs_.forget(label);
  state_.clear_show();
  tell_signs();
  return {};
}

// Call it with mutex_ held.
void Teacher::forget_all() {
  state_.Clear();
  walks_ = {};
  signs_ = {};
}

void Teacher::tell_signs() {
  state_.clear_sign();
  for (const auto& [label, shows] : signs_.signs()) {
    v1::TaughtSign& sign = *state_.add_sign();
    sign.set_label(label);
    sign.set_shows(static_cast<std::uint32_t>(shows.size()));
  }
}

Result<> Teacher::check_ready(const std::string& stream, Subject subject) const {
  const bool here = state_.stream() == stream;
  if (subject == Subject::kSigns) {
    return here ? signs_.check_ready() : gesture::SignLesson().check_ready();
  }
  for (const Walk walk : {Walk::kNeutral, Walk::kStyle}) {
    if (here && !walks_[at(walk)].empty()) continue;
    return fail(std::string("there is no good walk ") +
                (walk == Walk::kNeutral ? "as usual" : "in the style") + " of stream " +
                in_quotes(stream) + " yet; mark it first");
  }
  return {};
}

Result<> Teacher::train(const std::string& stream, const std::string& name, Subject subject) {
  const std::scoped_lock lock(mutex_);
  TRY(check_free());
  TRY(check_ready(stream, subject));
  asked_ns_ = clock_();
  name_ = name;
  subject_ = subject;
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
  forget_so_far();
  finish(Step::STEP_IDLE, {});
  changed_.notify_all();
  return {};
}

v1::Teaching Teacher::state() const {
  const std::scoped_lock lock(mutex_);
  v1::Teaching state = state_;
  if (state.step() == Step::STEP_MARKING) {
    state.set_seconds_left(std::max(0.0, seconds(marked_.until_ns - clock_())));
  }
  return state;
}

// Call it with mutex_ held. What was said of a walk that did not end.
void Teacher::forget_so_far() {
  if (state_.step() != Step::STEP_MARKING || !state_.label().empty()) return;
  words_of(marked_.walk).clear_sentence();
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
      forget_so_far();
      finish(Step::STEP_IDLE, "there is too little memory for this; mark shorter walks");
    }
  }
}

// A turn of collecting the walk or show.
void Teacher::collect(Lock& lock, Collected& collected) {
  if (collected.job != job_) {
    collected = {.job = job_,
                 .pupil = pupil_,
                 .marked = marked_,
                 .frames = clip::FramesClip(pupil_.skeleton)};
  }
  lock.unlock();
  bool over = clock_() >= collected.marked.until_ns + kLate_ns;
  while (tap_.consume([&](const Frame& frame) { over = collected.add(frame) || over; })) {
  }
  if (over) return check(lock, collected);
  if (collected.marked.label.empty()) {
    tell_so_far(lock, collected);
  } else {
    lock.lock();
  }
  if (!stop_ && collected.job == job_) changed_.wait_for(lock, kLookAtTap);
}

// Called without the lock, returns with it.
void Teacher::tell_so_far(Lock& lock, Collected& collected) {
  const std::int64_t now_ns = clock_();
  if (collected.tell_ns == 0) collected.tell_ns = collected.marked.from_ns + 3 * kTellEach_ns;
  if (now_ns < collected.tell_ns || collected.times.size() > kMaxTold) return lock.lock();
  style::TrainingClip take = collected.clip();
  const style::TakeCheck checked = collected.judge(take, now_ns);
  const std::int64_t took_ns = clock_() - now_ns;
  collected.tell_ns = now_ns + std::max(kTellEach_ns, kTellShare * took_ns);
  lock.lock();
  if (collected.job != job_) return;
  words_of(collected.marked.walk).set_sentence("so far: " + clean(checked.sentence()));
}

// The walk or show is over; called without the lock, returns with it.
void Teacher::check(Lock& lock, Collected& collected) {
  lock.lock();
  if (collected.job != job_) return;
  tapped_.store(pipeline::kNoStream, std::memory_order_relaxed);
  state_.set_step(Step::STEP_CHECKING);
  working_ = true;
  const Judged judged =
      collected.marked.label.empty() ? check_walk(lock, collected) : check_show(lock, collected);
  working_ = false;
  if (collected.job != job_) return;
  v1::TaughtWalk& words =
      collected.marked.label.empty() ? words_of(collected.marked.walk) : *state_.mutable_show();
  std::string sentence = clean(judged.sentence);
  if (const std::uint64_t lost = lost_; lost > 0) {
    sentence += fmt::format("; {} frames came faster than this computer could keep them", lost);
  }
  words.set_good(judged.good);
  words.set_sentence(sentence);
  if (collected.marked.label.empty()) {
    words.set_takes(static_cast<std::uint32_t>(walks_[at(collected.marked.walk)].size()));
  }
  tell_signs();
  finish(Step::STEP_IDLE, {});
  lock.unlock();
  spdlog::info("{}: {}: {}", collected.pupil.name, collected.what(), sentence);
  collected = {};
  lock.lock();
}

// Both are called with the lock, let go of it meanwhile, and keep what is good unless it was
// cancelled.
Teacher::Judged Teacher::check_walk(Lock& lock, const Collected& collected) {
  lock.unlock();
  auto take = std::make_shared<style::TrainingClip>(collected.clip());
  const style::TakeCheck checked = collected.judge(*take, collected.marked.until_ns);
  lock.lock();
  if (checked.good() && collected.job == job_) {
    auto& walks = walks_[at(collected.marked.walk)];
    if (!collected.marked.more) walks.clear();
    walks.push_back(std::move(take));
  }
  return {checked.good(), checked.sentence()};
}

Teacher::Judged Teacher::check_show(Lock& lock, Collected& collected) {
  gesture::SignLesson signs = signs_;
  lock.unlock();
  collected.hand.time_s = collected.times.in_seconds();
  const auto added = signs.add(collected.marked.label, std::move(collected.hand));
  lock.lock();
  if (added && collected.job == job_) signs_ = std::move(signs);
  return {added.has_value(), added ? *added : added.error().text()};
}

Teacher::Outcome Teacher::learn_style(const Walks& walks, const std::string& name,
                                      const std::function<bool()>& go_on) {
  std::vector<style::TrainingClip> clips;
  for (const Walk walk : {Walk::kNeutral, Walk::kStyle}) {
    for (const auto& take : walks[at(walk)]) {
      clips.push_back(*take);
      clips.back().group = walk == Walk::kNeutral ? kUsual : name;
    }
  }
  style::TrainingVerdict verdict;
  style::TrainOptions options;
  options.target = name;
  options.dataset.space = style::usual_space(clips);
  options.dataset.rate_hz = kTrainRate_hz;
  options.dataset.progress = [&](std::string_view, double) { return go_on(); };
  options.look = [&](const style::Findings& learnt) { verdict = learnt.verdict; };
  // Without FixedProducts, which are for the whole process: here others compute meanwhile. The log
  // keeps the model itself, so that nothing depends on making the same bits again.
  const auto model = style::train_style(clips, options);
  if (!model) return {.problem = model.error().text()};
  if (!verdict.usable) return {.problem = verdict.sentence};
  return {.bytes = style::serialize_model(*model), .verdict = verdict.sentence};
}

Teacher::Outcome Teacher::learn_signs(const gesture::SignLesson& signs,
                                      const std::function<bool()>& go_on) {
  auto learnt = signs.train(go_on);
  if (!learnt) return {.problem = learnt.error().text()};
  return {.bytes = std::move(learnt->bytes), .verdict = std::move(learnt->verdict)};
}

void Teacher::train_now(Lock& lock) {
  const std::uint64_t job = job_;
  const auto walks = walks_;
  const gesture::SignLesson signs = signs_;
  const Subject subject = subject_;
  const std::string name = name_;
  const std::string stream = state_.stream();
  working_ = true;
  lock.unlock();
  const auto go_on = [&] { return job_ == job; };
  Outcome outcome =
      subject == Subject::kSigns ? learn_signs(signs, go_on) : learn_style(walks, name, go_on);
  Result<std::string> file = std::string();
  if (!outcome.bytes.empty() && job_ == job) file = keep_(subject, name, outcome.bytes);
  if (!file) outcome.problem = file.error().text();
  lock.lock();
  working_ = false;
  if (job_ != job) return;
  if (!outcome.problem.empty()) return finish(Step::STEP_IDLE, outcome.problem);
  state_.set_verdict(clean(outcome.verdict));
  state_.set_model(*file);
  state_.set_step(Step::STEP_STARTING);
  model_ = {.stream = stream, .file = *file, .bytes = std::move(outcome.bytes)};
  call_();
  lock.unlock();
  spdlog::info("{}: learnt {}: {}", stream, *file, clean(outcome.verdict));
  lock.lock();
}

}  // namespace posed::teach
