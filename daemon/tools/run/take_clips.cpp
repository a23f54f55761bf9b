#include "daemon/tools/run/take_clips.hpp"

#include <algorithm>
#include <cctype>
#include <csignal>
#include <ctime>
#include <iterator>
#include <set>
#include <system_error>
#include <utility>

#include <spdlog/spdlog.h>

#include "daemon/system/realtime.hpp"
#include "daemon/tools/run/serve.hpp"
#include "proto/clip/clip.hpp"
#include "proto/clip/frames_clip.hpp"
#include "proto/frame/whole_file.hpp"
#include "proto/text/clean.hpp"

namespace posed::tools {
namespace {

// A mark is known to this object after the recorder's next turn, and the log has what came before
// it after the next commit.
constexpr std::chrono::milliseconds kKnown{1000};
constexpr std::chrono::milliseconds kKeepEvery{20};
constexpr std::size_t kMaxWaiting = 16'384;  // frames: 54 MB
constexpr std::size_t kMaxMissing = 256;

// A take's name as a part of its clips' names: ".sneak"; empty without one.
std::string ending_named(const std::string& take) {
  constexpr std::size_t kMaxBytes = 100;
  std::string text = take.empty() ? "" : "." + clean(take, kMaxBytes);
  for (std::size_t i = 1; i < text.size(); ++i) {
    const auto c = static_cast<unsigned char>(text[i]);
    const bool kept = c >= 0x80 || std::isalnum(c) != 0 || c == '-' || c == '_' || c == ' ';
    if (!kept) text[i] = '_';
  }
  return text;
}

Result<> write_bvh_of(Result<clip::Clip> clip, const std::filesystem::path& path) {
  if (!clip) return std::unexpected(clip.error());
  std::error_code error;
  if (std::filesystem::exists(path, error)) return fail("exists already", path.string());
  never_replace(path);
  clip::hold_missing(*clip);
  clip::hold_gaps(*clip);
  for (const std::string& warning : clip->warnings) {
    spdlog::warn("{}: {}", path.string(), warning);
  }
  TRY(clip::write_bvh(*clip, path));
  spdlog::info("wrote {}: {} frames", path.string(), clip->frames());
  return {};
}

bool end_signal_came() {
  const sigset_t signals = end_signals();
  constexpr timespec kAtOnce{};
  return sigtimedwait(&signals, nullptr, &kAtOnce) > 0;
}

// What a frame takes in memory until its clip is written.
std::size_t bytes_of_frame(const Skeleton& skeleton) {
  const std::size_t values = std::max(skeleton.channels.size(), 3 * skeleton.joints.size() + 3);
  return values * sizeof(double) + sizeof(Timecode) + 2 * sizeof(std::int64_t);
}

Error interrupted() {
  return fail("interrupted: the log is complete, but not all of its takes are clips").error();
}

}  // namespace

TakeClips::TakeClips(std::filesystem::path log, std::size_t max_kept)
    : log_(std::move(log)),
      max_kept_(max_kept),
      keeper_([this](const std::stop_token& stop) { keep_on(stop); }),
      writer_([this](const std::stop_token& stop) { write_on(stop); }) {}

void TakeClips::stream_comes(std::uint32_t id, Stream stream) {
  if (stream.skeleton == nullptr) return;
  const std::scoped_lock lock(mutex_);
  by_name_[stream.name].push_back(id);
  streams_.insert_or_assign(id, std::move(stream));
}

void TakeClips::take_changed(const log::TakeRow& take) {
  const std::scoped_lock lock(mutex_);
  changes_.push_back(take);
}

void TakeClips::add_to(v1::ControlReply& recordings) const {
  const std::scoped_lock lock(mutex_);
  for (const Missing& clip : missing_) {
    v1::KnownRecording& entry = *recordings.add_recording();
    entry.set_name(clip.file);
    entry.set_being_made(clip.problem.empty());
    entry.set_problem(clip.problem);
  }
}

RT_SAFE void TakeClips::frame(const Frame& frame, std::uint64_t item) noexcept {
  if (!tap_.push({frame, item})) lost_item_.store(item, std::memory_order_relaxed);
}

void TakeClips::keep_on(const std::stop_token& stop) {
  system::name_thread("posed-takes");
  while (!stop.stop_requested()) {
    keep(false);
    std::unique_lock lock(mutex_);
    wake_.wait_for(lock, stop, kKeepEvery, [] { return false; });
  }
}

// `all`: no frame and no mark is still to come.
void TakeClips::keep(bool all) {
  const auto now = Clock::now();
  std::vector<log::TakeRow> changes;
  {
    const std::scoped_lock lock(mutex_);
    changes.swap(changes_);
  }
  for (const log::TakeRow& row : changes) learn(row, now);
  while (tap_.consume([&](const Moment& moment) { waiting_.push_back({moment, now}); })) {
  }
  while (!waiting_.empty()) {
    const bool full = waiting_.size() > kMaxWaiting;
    if (!all && !full && now - waiting_.front().since < kKnown) break;
    assign(waiting_.front().moment);
    waiting_.pop_front();
  }
  // Also while no frames come. Those that came before the end was known no longer wait.
  while (!takes_.empty()) {
    const Kept& first = takes_.front();
    const bool ended = first.row.last_item != log::kToTheEnd && now - first.ended > 2 * kKnown;
    if (!all && !ended) break;
    close_first();
  }
}

void TakeClips::learn(const log::TakeRow& row, Clock::time_point now) {
  if (!takes_.empty() && takes_.back().row.id == row.id) {
    takes_.back().row = row;
  } else {
    takes_.push_back({.row = row});
    takes_.back().whole = assigned_ < row.first_item;
  }
  Kept& take = takes_.back();
  if (row.last_item == log::kToTheEnd) return;
  take.ended = now;
  if (assigned_ > row.last_item) give_up(take);  // it may have got what came behind its end
}

void TakeClips::assign(const Moment& moment) {
  while (!takes_.empty() && moment.item > takes_.front().row.last_item) close_first();
  assigned_ = moment.item;
  if (takes_.empty() || !holds(takes_.front().row, moment.item)) return;
  if (takes_.front().whole) add(takes_.front(), moment);
}

void TakeClips::add(Kept& take, const Moment& moment) {
  const std::uint32_t id = moment.frame.header.stream;
  const std::scoped_lock lock(mutex_);
  const auto known = streams_.find(id);
  if (known == streams_.end()) return;
  const Stream& stream = known->second;
  auto name = take.names.find(id);
  if (name == take.names.end()) name = take.names.emplace(id, clip_name(id)).first;
  auto part = take.parts.find(name->second);
  if (part == take.parts.end()) {
    part = take.parts
               .emplace(name->second,
                        Part{.frames = FrameCollector(stream.skeleton), .rate_hz = stream.rate_hz})
               .first;
  }
  part->second.frames.add(moment.frame);
  const std::size_t bytes = bytes_of_frame(*stream.skeleton);
  part->second.bytes += bytes;
  if (kept_.fetch_add(bytes) + bytes <= max_kept_) return;
  spdlog::info("take {} is too long for memory: its clips come later, from the log", take.row.id);
  give_up(take);
}

void TakeClips::give_up(Kept& take) {
  take.whole = false;
  for (const auto& [name, part] : take.parts) kept_ -= part.bytes;
  take.parts.clear();
}

void TakeClips::close_first() {
  Kept take = std::move(takes_.front());
  takes_.pop_front();
  if (lost_item_.load(std::memory_order_relaxed) >= take.row.first_item) give_up(take);
  const std::scoped_lock lock(mutex_);
  std::set<std::string> names;
  for (const auto& [id, before] : take.names) {
    const std::string name = clip_name(id);
    if (before != name) give_up(take);
    names.insert(name);
  }
  for (const std::string& name : names) {
    const auto part = take.parts.find(name);
    if (take.whole && (part == take.parts.end() || part->second.frames.frames() < 2)) continue;
    missing_.push_back({.take = take.row.id,
                        .file = clean(path_of(take.row, name).filename().string()),
                        .problem = {}});
    if (missing_.size() > kMaxMissing) missing_.pop_front();
  }
  closed_.push_back(std::move(take));
  wake_.notify_all();
}

// As in a replay of the log: parts of a stream with skeletons of their own are clips of their own.
std::string TakeClips::clip_name(std::uint32_t stream) const {
  const Stream& own = streams_.at(stream);
  const std::vector<std::uint32_t>& parts = by_name_.at(own.name);
  const bool one = std::ranges::all_of(parts, [&](std::uint32_t other) {
    return streams_.at(other).skeleton->id == own.skeleton->id;
  });
  const auto number = std::ranges::find(parts, stream) - parts.begin() + 1;
  return one ? own.name : own.name + "#" + std::to_string(number);
}

std::filesystem::path TakeClips::path_of(const log::TakeRow& take,
                                         const std::string& stream) const {
  return log_.parent_path() / (log_.stem().string() + "-" + std::to_string(take.id) + "-" + stream +
                               ending_named(take.name) + ".bvh");
}

void TakeClips::write_on(const std::stop_token& stop) {
  system::name_thread("posed-clips");
  system::give_way();
  const auto goes_on = [&] { return !stop.stop_requested(); };
  while (goes_on()) {
    std::unique_lock lock(mutex_);
    if (!wake_.wait(lock, stop, [this] { return !closed_.empty(); })) return;
    Kept take = std::move(closed_.front());
    closed_.pop_front();
    lock.unlock();
    const auto done = write(take, goes_on);
    if (done) continue;
    if (goes_on()) {
      spdlog::warn("clips of take {} are written when posed ends: {}", take.row.id,
                   done.error().text());
    }
    later_.push_back(std::move(take));
  }
}

// A clip that cannot be written is a warning; the log is not changed.
Result<> TakeClips::write(Kept& take, const std::function<bool()>& goes_on) {
  if (!take.whole) {
    const auto each = [&](const std::string& stream, Result<clip::Clip> clip) {
      write_clip(take, stream, std::move(clip));
    };
    TRY(each_clip_of_take(log_, take.row, each, goes_on));
    not_missing(take.row.id);
    return {};
  }
  while (!take.parts.empty()) {
    if (!goes_on()) return std::unexpected(interrupted());
    const auto& [stream, part] = *take.parts.begin();
    if (part.frames.frames() >= 2) {
      write_clip(take, stream, part.frames.finish(log_.string(), part.rate_hz));
    }
    kept_ -= part.bytes;
    take.parts.erase(take.parts.begin());
  }
  return {};
}

void TakeClips::write_clip(const Kept& take, const std::string& stream, Result<clip::Clip> clip) {
  const std::filesystem::path path = path_of(take.row, stream);
  const std::string file = clean(path.filename().string());
  if (const auto written = write_bvh_of(std::move(clip), path); !written) {
    const std::string why = written.error().text();
    spdlog::warn("take {} of stream {} is no clip: {}", take.row.id, stream, why);
    const std::scoped_lock lock(mutex_);
    for (Missing& one : missing_) {
      if (one.file == file) one.problem = clean(why);
    }
    return;
  }
  not_missing(take.row.id, file);
}

// Without a file: all of the take that are still said to be on their way.
void TakeClips::not_missing(std::int64_t take, const std::string& file) {
  const std::scoped_lock lock(mutex_);
  std::erase_if(missing_, [&](const Missing& clip) {
    return clip.take == take && (file.empty() ? clip.problem.empty() : clip.file == file);
  });
}

void TakeClips::stop() {
  keeper_.request_stop();
  writer_.request_stop();
  keeper_.join();
  writer_.join();
}

Result<> TakeClips::finish() {
  keep(true);
  std::ranges::move(closed_, std::back_inserter(later_));
  // Those that need no log come first: what is wrong with the log costs them nothing.
  std::ranges::stable_partition(later_, &Kept::whole);
  Result<> done;
  for (Kept& take : later_) {
    const auto goes_on = [] { return !end_signal_came(); };
    if (!goes_on()) return std::unexpected(interrupted());
    if (auto written = write(take, goes_on); !written && done) done = std::move(written);
  }
  return done;
}

}  // namespace posed::tools
