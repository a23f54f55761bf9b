#include "daemon/replay/log_clip.hpp"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "daemon/replay/log_takes.hpp"
#include "daemon/replay/replay.hpp"
#include "proto/clip/frames_clip.hpp"
#include "proto/log/reader.hpp"
#include "proto/text/clean.hpp"
#include "proto/text/stream_name.hpp"

namespace posed::replay {
namespace {

// The streams of one name, in the order in which they came.
using Parts = std::vector<std::uint32_t>;

// Only streams with a skeleton, because others have no pose.
std::map<std::string, Parts> parts_by_name(const Replay& replay) {
  std::map<std::string, Parts> parts;
  for (std::uint32_t id = 0; id < replay.streams(); ++id) {
    const ReplayStream& stream = replay.stream(id);
    if (stream.published != nullptr) parts[stream.name].push_back(id);
  }
  const auto first_item = [&](std::uint32_t id) { return replay.stream(id).first_item; };
  for (auto& [name, ids] : parts) std::ranges::stable_sort(ids, {}, first_item);
  return parts;
}

// Of the frames that the stream published, or of its unstyled ones.
std::shared_ptr<const Skeleton> skeleton_of(const Replay& replay, std::uint32_t id, bool raw) {
  const ReplayStream& stream = replay.stream(id);
  return raw ? stream.description.skeleton : stream.published;
}

// The part that "walker#2" names; empty if there is none.
Parts part_named(const std::map<std::string, Parts>& parts, const std::string& wanted) {
  for (const auto& [name, ids] : parts) {
    for (std::size_t i = 0; i < ids.size(); ++i) {
      if (wanted == name + "#" + std::to_string(i + 1)) return {ids[i]};
    }
  }
  return {};
}

// A clip has one skeleton.
Result<> check_same_skeleton(const Replay& replay, const std::string& name, const Parts& ids,
                             const std::string& path, bool raw = false) {
  const auto id_of = [&](std::uint32_t id) { return skeleton_of(replay, id, raw)->id; };
  const auto differs = [&](std::uint32_t id) { return id_of(id) != id_of(ids.front()); };
  if (std::ranges::none_of(ids, differs)) return {};
  std::string list;
  for (std::size_t i = 0; i < ids.size(); ++i) {
    list += (i == 0 ? "" : ", ") + name + "#" + std::to_string(i + 1) + " (" +
            std::to_string(skeleton_of(replay, ids[i], raw)->joints.size()) + " joints)";
  }
  return misuse("stream " + in_quotes(name) +
                    " changed its skeleton, so its parts are clips of their own; name one by"
                    " --stream: " +
                    list,
                path);
}

// The streams that become one clip.
struct Chosen {
  Parts ids;
  bool raw = false;  // the unstyled frames of them
};

Result<Chosen> choose(const Replay& replay, const std::string& wanted, const std::string& path) {
  const auto parts = parts_by_name(replay);
  if (parts.empty()) return fail("has no stream with a skeleton", path);
  std::string names;
  for (const auto& [name, ids] : parts) names += (names.empty() ? "" : ", ") + name;
  const bool raw = wanted.ends_with(kRawSuffix) && !parts.contains(wanted);
  const std::string stream = raw ? wanted.substr(0, wanted.size() - kRawSuffix.size()) : wanted;
  if (stream.empty() && parts.size() > 1) {
    return misuse("has the streams " + names + "; name one by --stream", path);
  }
  const auto found = stream.empty() ? parts.begin() : parts.find(stream);
  Chosen chosen{.ids = found == parts.end() ? part_named(parts, stream) : found->second,
                .raw = raw};
  if (chosen.ids.empty()) {
    return misuse("has no stream " + in_quotes(stream) + " with a skeleton, but " + names, path);
  }
  if (raw && !replay.stream(chosen.ids.front()).settings.publish_raw) {
    return fail(
        "stream " + in_quotes(replay.stream(chosen.ids.front()).name) +
            " was recorded without `publish_raw = true`, so its unstyled motion is not in the log",
        path);
  }
  const std::string& name = replay.stream(chosen.ids.front()).name;
  if (auto same = check_same_skeleton(replay, name, chosen.ids, path, raw); !same) {
    return std::unexpected(same.error());
  }
  return chosen;
}

// Collects the frames of a stream's parts as they were published, each once.
class Collector {
 public:
  explicit Collector(const std::shared_ptr<const Skeleton>& skeleton) : clip_(skeleton) {}

  void add(const Frame& frame) {
    const Header& header = frame.header;
    if (part_ != header.stream) {
      if (last_ != 0) ++returns_;
      last_ = 0;
      part_ = header.stream;
    }
    if (header.sequence <= last_) return;  // repeated while the stream was stale
    missing_ += last_ == 0 ? 0 : header.sequence - last_ - 1;
    last_ = header.sequence;
    arrival_ns_.push_back(header.arrival_ns);
    device_ns_.push_back(header.device_ns);
    clip_.add(frame);
  }

  [[nodiscard]] std::size_t frames() const { return arrival_ns_.size(); }

  [[nodiscard]] Result<clip::Clip> finish(const std::string& path, double rate_hz) const {
    auto clip = clip_.finish(path, rate_hz, times_s());
    if (clip && missing_ > 0) {
      clip->warnings.push_back(std::to_string(missing_) +
                               " frames were skipped while the daemon ran and are not in the clip");
    }
    if (clip && returns_ > 0) {
      clip->warnings.push_back("the body came back " + std::to_string(returns_) +
                               " times; the clip goes on with its next frame");
    }
    return clip;
  }

 private:
  // Device times if all frames have them and they increase; a device's time restarts with each
  // link.
  [[nodiscard]] std::vector<double> times_s() const {
    const bool running = std::ranges::find(device_ns_, kNoTime_ns) == device_ns_.end() &&
                         std::ranges::is_sorted(device_ns_, std::ranges::less_equal());
    std::vector<double> times_s;
    for (const std::int64_t time_ns : running ? device_ns_ : arrival_ns_) {
      const std::int64_t first_ns = running ? device_ns_.front() : arrival_ns_.front();
      times_s.push_back(seconds(time_ns - first_ns));
    }
    return times_s;
  }

  clip::FramesClip clip_;
  std::uint32_t part_ = pipeline::kNoStream;
  std::uint64_t last_ = 0, missing_ = 0, returns_ = 0;
  std::vector<std::int64_t> arrival_ns_, device_ns_;
};

// By stream, the name of its clip: that of the stream, or "walker#2" if its skeleton changes.
std::map<std::uint32_t, std::string> clip_names(const Replay& replay) {
  std::map<std::uint32_t, std::string> names;
  for (const auto& [name, ids] : parts_by_name(replay)) {
    const bool one = check_same_skeleton(replay, name, ids, {}).has_value();
    for (std::size_t i = 0; i < ids.size(); ++i) {
      names[ids[i]] = one ? name : name + "#" + std::to_string(i + 1);
    }
  }
  return names;
}

// Collects one take after the other.
class TakeCollector {
 public:
  TakeCollector(const Replay& replay, std::vector<log::TakeRow> takes, std::string file,
                const EachTakeClip& each)
      : replay_(replay),
        takes_(std::move(takes)),
        file_(std::move(file)),
        each_(each),
        names_(clip_names(replay)) {}

  void add(const pipeline::Item& item) {
    while (next_ < takes_.size() && replay_.position() > takes_[next_].last_item) end_take();
    const auto name = names_.find(item.frame.header.stream);
    if (item.kind != pipeline::Item::Kind::kFrame || name == names_.end()) return;
    if (next_ == takes_.size() || !holds(takes_[next_], replay_.position())) return;
    collectors_.try_emplace(name->second, replay_.stream(name->first).published)
        .first->second.add(item.frame);
    rate_hz_[name->second] = replay_.stream(name->first).description.rate_hz;
  }
  void finish() {
    while (next_ < takes_.size()) end_take();
  }

 private:
  void end_take() {
    for (const auto& [name, collector] : collectors_) {
      if (collector.frames() < 2) continue;  // no clip
      each_(takes_[next_], name, collector.finish(file_, rate_hz_[name]));
    }
    collectors_.clear();
    ++next_;
  }

  const Replay& replay_;
  std::vector<log::TakeRow> takes_;  // in their order; they do not overlap
  std::string file_;
  const EachTakeClip& each_;
  std::map<std::uint32_t, std::string> names_;  // of the clips, by stream
  std::map<std::string, Collector> collectors_;
  std::map<std::string, double> rate_hz_;  // as collectors_
  std::size_t next_ = 0;                   // the take that is collected
};

}  // namespace

Result<clip::Clip> clip_of_log(const std::filesystem::path& path, const std::string& stream,
                               const std::string& wanted_take) {
  auto reader = log::Reader::open(path);
  if (!reader) return std::unexpected(reader.error());
  log::TakeRow interval{.name = {}, .last_item = log::kToTheEnd};
  if (!wanted_take.empty()) {
    auto found = find_take(*reader, wanted_take);
    if (!found) return std::unexpected(found.error());
    interval = std::move(*found);
  }
  auto opened = Replay::open(*reader);
  if (!opened) return std::unexpected(opened.error());
  Replay& replay = **opened;
  const auto chosen = choose(replay, stream, path.string());
  if (!chosen) return std::unexpected(chosen.error());
  const ReplayStream& first = replay.stream(chosen->ids.front());
  Collector collector(skeleton_of(replay, chosen->ids.front(), chosen->raw));
  const auto kind = chosen->raw ? pipeline::Item::Kind::kRawFrame : pipeline::Item::Kind::kFrame;
  const auto take = [&](const pipeline::Item& item) {
    if (item.kind == kind && holds(interval, replay.position()) &&
        std::ranges::find(chosen->ids, item.frame.header.stream) != chosen->ids.end()) {
      collector.add(item.frame);
    }
  };
  const auto done = replay.run(
      take, [&](const log::ChunkRow&) { return replay.position() <= interval.last_item; });
  if (!done) return std::unexpected(done.error());
  if (!wanted_take.empty() && collector.frames() < 2) {
    return fail("take " + std::to_string(interval.id) + " has " +
                    std::to_string(collector.frames()) + " frames of stream " +
                    in_quotes(first.name) + ", and a clip needs two",
                path.string());
  }
  auto clip = collector.finish(path.string(), first.description.rate_hz);
  if (!clip) return clip;
  for (const std::uint32_t id : chosen->ids) {
    const auto broken = replay.broken_at(id);
    if (!broken) continue;
    clip->warnings.push_back("the log is known to lack data from frame " + std::to_string(*broken) +
                             " on");
    break;
  }
  return clip;
}

Result<> each_take_clip(const std::filesystem::path& path, const EachTakeClip& each,
                        const std::function<bool()>& goes_on) {
  auto reader = log::Reader::open(path);
  if (!reader) return std::unexpected(reader.error());
  auto takes = reader->takes();
  if (!takes) return std::unexpected(takes.error());
  if (takes->empty()) return {};
  auto opened = Replay::open(*reader);
  if (!opened) return std::unexpected(opened.error());
  TakeCollector collector(**opened, std::move(*takes), path.string(), each);
  bool stopped = false;
  const auto done =
      (*opened)->run([&](const pipeline::Item& item) { collector.add(item); },
                     [&](const log::ChunkRow&) { return !(stopped = stopped || !goes_on()); });
  if (!done) return done;
  if (stopped) return fail("interrupted: the log is complete, but not all of its takes are clips");
  collector.finish();
  return {};
}

}  // namespace posed::replay
