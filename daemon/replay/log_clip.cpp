#include "daemon/replay/log_clip.hpp"

#include <algorithm>
#include <cstdint>
#include <functional>
#include <memory>
#include <optional>
#include <utility>
#include <vector>

#include "daemon/replay/replay.hpp"
#include "proto/clip/frames_clip.hpp"
#include "proto/log/reader.hpp"
#include "proto/text/clean.hpp"

namespace posed::replay {
namespace {

// Only streams with a skeleton, because others have no pose.
std::string names_of(const Replay& replay) {
  std::string names;
  for (std::uint32_t id = 0; id < replay.streams(); ++id) {
    const ReplayStream& stream = replay.stream(id);
    if (stream.description.skeleton == nullptr) continue;
    names += (names.empty() ? "" : ", ") + stream.name;
  }
  return names;
}

Result<std::uint32_t> choose(const Replay& replay, const std::string& wanted,
                             const std::string& path) {
  const std::string names = names_of(replay);
  if (names.empty()) return fail("has no stream with a skeleton", path);
  std::optional<std::uint32_t> chosen;
  for (std::uint32_t id = 0; id < replay.streams(); ++id) {
    const ReplayStream& stream = replay.stream(id);
    if (stream.description.skeleton == nullptr) continue;
    if (!wanted.empty() && stream.name != wanted) continue;
    if (chosen) return misuse("has the streams " + names + "; name one by --stream", path);
    chosen = id;
  }
  if (!chosen) {
    return misuse("has no stream " + in_quotes(wanted) + " with a skeleton, but " + names, path);
  }
  return *chosen;
}

// Collects the frames of one stream as they were published, each once.
class Collector {
 public:
  explicit Collector(std::shared_ptr<const Skeleton> skeleton) : clip_(std::move(skeleton)) {}

  void take(const Frame& frame) {
    const Header& header = frame.header;
    if (header.sequence <= last_) return;  // repeated while the stream was stale
    missing_ += last_ == 0 ? 0 : header.sequence - last_ - 1;
    last_ = header.sequence;
    arrival_ns_.push_back(header.arrival_ns);
    device_ns_.push_back(header.device_ns);
    clip_.add(frame);
  }

  [[nodiscard]] Result<clip::Clip> finish(const std::string& path, double rate_hz) const {
    auto clip = clip_.finish(path, rate_hz, times_s());
    if (clip && missing_ > 0) {
      clip->warnings.push_back(std::to_string(missing_) +
                               " frames were skipped while the daemon ran and are not in the clip");
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
  std::uint64_t last_ = 0, missing_ = 0;
  std::vector<std::int64_t> arrival_ns_, device_ns_;
};

}  // namespace

Result<clip::Clip> clip_of_log(const std::filesystem::path& path, const std::string& stream) {
  auto reader = log::Reader::open(path);
  if (!reader) return std::unexpected(reader.error());
  auto opened = Replay::open(*reader);
  if (!opened) return std::unexpected(opened.error());
  Replay& replay = **opened;
  const auto id = choose(replay, stream, path.string());
  if (!id) return std::unexpected(id.error());
  const drivers::Description& description = replay.stream(*id).description;
  Collector collector(description.skeleton);
  const auto take = [&](const pipeline::Item& item) {
    if (item.kind == pipeline::Item::Kind::kFrame && item.frame.header.stream == *id) {
      collector.take(item.frame);
    }
  };
  const auto done = replay.run(take, [](const log::ChunkRow&) { return true; });
  if (!done) return std::unexpected(done.error());
  auto clip = collector.finish(path.string(), description.rate_hz);
  if (const auto broken = replay.broken_at(*id); clip && broken) {
    clip->warnings.push_back("the log is known to lack data from frame " + std::to_string(*broken) +
                             " on");
  }
  return clip;
}

}  // namespace posed::replay
