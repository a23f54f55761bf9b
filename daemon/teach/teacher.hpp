// Teacher: teaches one stream at a time a style while it runs. It keeps the frames of two walks, as
// the publisher hands them over, checks each with what training itself asks of a clip, and trains
// on both with the code of `posed train style`, on a thread that gives way to all others. Whoever
// controls the stream then gives it the model (control::RequestHandler).
//
// Bounds: one teaching at a time, two walks of at most kMaxWalk_s and kMaxWalkFrames each, and a
// ring of kTapSlots frames between the publisher and the thread. What the thread cannot take in
// time is missing from the walk, never from the stream.
#pragma once

#include <array>
#include <atomic>
#include <condition_variable>
#include <cstddef>
#include <cstdint>
#include <functional>
#include <memory>
#include <mutex>
#include <optional>
#include <string>
#include <string_view>
#include <thread>

#include "daemon/pipeline/raw_tap.hpp"
#include "daemon/pipeline/ring.hpp"
#include "daemon/system/clock.hpp"
#include "models/style/train/dataset.hpp"
#include "posed/v1/control.pb.h"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::teach {

inline constexpr double kMinWalk_s = 6.0;
inline constexpr double kMaxWalk_s = 120.0;
inline constexpr std::size_t kMaxWalkFrames = 28'800;  // two minutes at 240 Hz
inline constexpr std::size_t kTapSlots = 1024;         // four seconds at 240 Hz

enum class Walk : std::uint8_t { kNeutral, kStyle };

// The stream that is taught, as it is there now.
struct Pupil {
  std::uint32_t stream = 0;  // id
  std::string name{};
  std::shared_ptr<const Skeleton> skeleton{};  // of its frames before all stages; not null
};

struct TaughtModel {
  std::string stream;  // name
  std::string file;    // in the folder of models
  std::string bytes;
};

class Teacher final : public pipeline::RawTap {
 public:
  // Keeps a model under a name that is like this one and not taken; returns the file's name.
  using Keep = std::function<Result<std::string>(const std::string& name, std::string_view bytes)>;

  // Starts the thread, which calls both functions. `call` tells that take_model() has one.
  Teacher(Keep keep, std::function<void()> call, Clock clock = system::monotonic_ns);
  // Gives up what is under way.
  ~Teacher() override;

  // All below: any cold thread. Errors are sentences for the client.
  // Begins to keep a walk of the stream. A walk of another stream or skeleton is forgotten.
  Result<> mark(const Pupil& pupil, Walk walk, double seconds);
  // Begins to train on the stream's two walks.
  Result<> train(const std::string& stream, const std::string& name);
  // Ends what is under way; walks that are marked stay.
  Result<> cancel(const std::string& stream);
  [[nodiscard]] v1::Teaching state() const;

  // The trained model, once; tell then what came of it.
  [[nodiscard]] std::optional<TaughtModel> take_model();
  void started(std::uint64_t sequence);  // of the first frame with it
  void not_started(const std::string& why);

  // The publisher's thread.
  RT_SAFE void raw_frame(const Frame& frame) noexcept override;

 private:
  struct Collected;
  using Lock = std::unique_lock<std::mutex>;

  void run();
  void collect(Lock& lock, Collected& collected);
  void check(Lock& lock, Collected& collected);
  void train_now(Lock& lock);
  // These need mutex_.
  [[nodiscard]] bool is_under_way() const;
  void forget_outcome();  // of the lesson before
  [[nodiscard]] Result<> check_free() const;
  [[nodiscard]] v1::TaughtWalk& words_of(Walk walk);
  void finish(v1::Teaching::Step step, const std::string& problem);

  const Keep keep_;
  const std::function<void()> call_;
  const Clock clock_;

  // Between the publisher and the thread.
  pipeline::Ring<Frame> tap_{kTapSlots};
  std::atomic<std::uint32_t> tapped_;   // the stream that is marked
  std::atomic<std::uint64_t> lost_{0};  // frames of this walk for which the ring had no room

  mutable std::mutex mutex_;  // guards all below, of which job_ is read without it, too
  std::condition_variable changed_;
  bool stop_ = false;
  bool working_ = false;  // the thread checks or trains, perhaps what was cancelled meanwhile
  std::atomic<std::uint64_t> job_{0};  // what is under way; another number: it was cancelled
  v1::Teaching state_;
  Pupil pupil_;
  Walk walk_ = Walk::kNeutral;  // that is marked
  std::int64_t from_ns_ = 0, until_ns_ = 0;
  std::int64_t asked_ns_ = 0;  // for the training
  std::string name_;           // of the style
  // By Walk; null: there is none that serves.
  std::array<std::shared_ptr<const style::TrainingClip>, 2> walks_;
  std::optional<TaughtModel> model_;  // for take_model()

  std::thread thread_;
};

}  // namespace posed::teach
