// TakeClips: each take of each stream of a recording as a BVH beside its log, some seconds after
// the take has ended. The frames are kept in memory as they leave the stages. Where that is not
// possible (takes not yet written of more than kMaxKept bytes together, a thread that was too slow,
// a body that changed its skeleton meanwhile) the log is replayed up to the take's end, which gives
// the same frames and takes longer. Cold, but for frame().
#pragma once

#include <atomic>
#include <chrono>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <deque>
#include <filesystem>
#include <functional>
#include <map>
#include <memory>
#include <mutex>
#include <stop_token>
#include <string>
#include <thread>
#include <vector>

#include "daemon/pipeline/raw_tap.hpp"
#include "daemon/pipeline/ring.hpp"
#include "daemon/tools/export/log_clip.hpp"
#include "posed/v1/control.pb.h"
#include "proto/frame/frame.hpp"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"
#include "proto/log/rows.hpp"

namespace posed::tools {

class TakeClips final : public pipeline::FrameTap {
 public:
  static constexpr std::size_t kMaxKept = 256UL * 1024 * 1024;

  // Starts a thread that keeps frames and one of nice 19 that writes clips, while `log` grows.
  // `max_kept`: bytes of frames in memory; smaller in tests.
  explicit TakeClips(std::filesystem::path log, std::size_t max_kept = kMaxKept);
  ~TakeClips() override = default;

  struct Stream {
    std::string name{};
    std::shared_ptr<const Skeleton> skeleton{};  // of its finished frames; null: it has no pose
    double rate_hz = 0.0;                        // as the log has it; 0: not known
  };
  // A stream comes, before its first frame. Any thread.
  void stream_comes(std::uint32_t id, Stream stream);
  // A take has begun or ended: its row as the log gets it. Any thread; returns at once.
  void take_changed(const log::TakeRow& take);
  // Adds the clips that are being made, or could not be. Any thread.
  void add_to(v1::ControlReply& recordings) const;
  RT_SAFE void frame(const Frame& frame, std::uint64_t item) noexcept override;

  // Ends the threads, which may be reading the log: after the last frame, and before the log
  // becomes a single file, because that needs it alone.
  void stop();
  // After stop(), when the log is complete: writes those that are not written yet, also of a take
  // that was never ended. Call once. Returns the first error, after which it goes on; an end signal
  // that comes meanwhile ends the work with an error: block end_signals() before.
  Result<> finish();

 private:
  using Clock = std::chrono::steady_clock;
  static constexpr std::size_t kTapSlots = 2048;

  struct Moment {
    Frame frame{};
    std::uint64_t item = 0;
  };
  // A frame waits until the marks of takes that may concern it are known.
  struct Waiting {
    Moment moment{};
    Clock::time_point since{};
  };
  struct Part {
    FrameCollector frames;
    double rate_hz = 0.0;
    std::size_t bytes = 0;  // of its frames
  };
  struct Kept {
    log::TakeRow row{};
    Clock::time_point ended{};                     // when its end became known
    bool whole = true;                             // every frame is here
    std::map<std::string, Part> parts{};           // by the clip's stream
    std::map<std::uint32_t, std::string> names{};  // of the clips, by stream
  };
  // A clip that is not there.
  struct Missing {
    std::int64_t take = 0;
    std::string file{};     // without the folder
    std::string problem{};  // empty: it is being made
  };

  // Of the keeping thread, then of finish().
  void keep_on(const std::stop_token& stop);
  void keep(bool all);
  void learn(const log::TakeRow& row, Clock::time_point now);
  void assign(const Moment& moment);
  void add(Kept& take, const Moment& moment);
  void give_up(Kept& take);
  void close_first();

  // Of the writing thread, then of finish().
  void write_on(const std::stop_token& stop);
  Result<> write(Kept& take, const std::function<bool()>& goes_on);
  void write_clip(const Kept& take, const std::string& stream, Result<clip::Clip> clip);

  [[nodiscard]] std::filesystem::path path_of(const log::TakeRow& take,
                                              const std::string& stream) const;
  [[nodiscard]] std::string clip_name(std::uint32_t stream) const;  // with mutex_ held
  void not_missing(std::int64_t take, const std::string& file = {});

  std::filesystem::path log_;
  const std::size_t max_kept_;
  pipeline::Ring<Moment> tap_{kTapSlots};
  std::atomic<std::uint64_t> lost_item_{0};  // of the newest frame that the ring had no room for
  std::atomic<std::size_t> kept_{0};         // bytes of frames of all takes

  // Of the keeping thread.
  std::deque<Waiting> waiting_;
  std::deque<Kept> takes_;      // that are not closed, in their order
  std::uint64_t assigned_ = 0;  // item of the last frame that no longer waits

  // Of the writing thread.
  std::deque<Kept> later_;  // whose replay failed while the log grew

  mutable std::mutex mutex_;  // guards the following
  std::condition_variable_any wake_;
  std::vector<log::TakeRow> changes_;        // that the keeping thread has not seen
  std::map<std::uint32_t, Stream> streams_;  // all that ever came
  std::map<std::string, std::vector<std::uint32_t>> by_name_;  // the same, in their order
  std::deque<Kept> closed_;                                    // to be written
  std::deque<Missing> missing_;

  std::jthread keeper_, writer_;  // last, because they use all the others
};

}  // namespace posed::tools
