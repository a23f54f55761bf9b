// Teacher: teaches one stream at a time a style, or the signs of a hand, while it runs. It keeps
// the frames of walks and of shows, as the publisher hands them over, checks each with what
// training itself asks of a clip, and trains with the code of `posed train`, on a thread that gives
// way to all others. Whoever controls the stream then gives it the model
// (control::RequestHandler).
//
// Bounds: one teaching at a time, kMaxWalks walks of each kind of at most kMaxWalk_s at
// kMaxKeptRate_hz until there are kMaxKeptNumbers, the shows of a SignLesson, and a ring of
// kTapSlots frames between the publisher and the thread. What the thread cannot take in time is
// missing from the walk, never from the stream.
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
#include <vector>

#include "daemon/pipeline/raw_tap.hpp"
#include "daemon/pipeline/ring.hpp"
#include "daemon/system/clock.hpp"
#include "models/gesture/sign_lesson.hpp"
#include "models/style/train/dataset.hpp"
#include "posed/v1/control.pb.h"
#include "proto/frame/result.hpp"
#include "proto/frame/skeleton.hpp"

namespace posed::teach {

inline constexpr double kMinWalk_s = 6.0;
inline constexpr double kMaxWalk_s = 120.0;
inline constexpr std::size_t kMaxWalks = 8;  // of each kind
// Values of all channels that are kept of a kind; then no further walk.
inline constexpr std::size_t kMaxKeptNumbers = 3'000'000;
inline constexpr double kMinShow_s = 3.0;
inline constexpr double kMaxShow_s = 15.0;
// Frames a second that are kept of a walk or show: of a faster stream every second, fourth, ...
// one. Training looks at 30.
inline constexpr double kMaxKeptRate_hz = 64.0;
inline constexpr std::size_t kTapSlots = 1024;  // four seconds at 240 Hz

enum class Walk : std::uint8_t { kNeutral, kStyle };
enum class Subject : std::uint8_t { kStyle, kSigns };

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
  using Keep = std::function<Result<std::string>(Subject subject, const std::string& name,
                                                 std::string_view bytes)>;

  // Starts the thread, which calls both functions. `call` tells that take_model() has one.
  Teacher(Keep keep, std::function<void()> call, Clock clock = system::monotonic_ns);
  // Gives up what is under way.
  ~Teacher() override;

  // All below: any cold thread. Errors are sentences for the client.
  // Begins to keep a walk of the stream, beside the earlier ones of its kind (`more`) or, once it
  // is good, in their place. There is one lesson, which all clients see: while that of another
  // stream is not finished it must be forgotten first.
  Result<> mark(const Pupil& pupil, Walk walk, double seconds, bool more = false);
  // Begins to keep a show of a sign of a hand, as mark() does.
  Result<> show(const Pupil& pupil, const std::string& label, double seconds);
  // Forgets a sign; with an empty label everything that was marked.
  Result<> forget(const std::string& stream, const std::string& label);
  // Begins to train on the stream's walks, or on the signs that were shown.
  Result<> train(const std::string& stream, const std::string& name,
                 Subject subject = Subject::kStyle);
  // Ends what is under way; what is marked stays.
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
  struct Outcome;
  struct Judged {
    bool good = false;
    std::string sentence;
  };
  using Lock = std::unique_lock<std::mutex>;
  // What is being kept.
  struct Marked {
    Walk walk = Walk::kNeutral;
    bool more = false;    // beside earlier walks
    std::string label{};  // of a sign; empty: it is a walk
    std::int64_t from_ns = 0, until_ns = 0;
  };
  // By Walk: those that serve.
  using Walks = std::array<std::vector<std::shared_ptr<const style::TrainingClip>>, 2>;
  static Outcome learn_style(const Walks& walks, const std::string& name,
                             const std::function<bool()>& go_on);
  static Outcome learn_signs(const gesture::SignLesson& signs, const std::function<bool()>& go_on);

  void run();
  void collect(Lock& lock, Collected& collected);
  void tell_so_far(Lock& lock, Collected& collected);
  void check(Lock& lock, Collected& collected);
  Judged check_walk(Lock& lock, const Collected& collected);
  Judged check_show(Lock& lock, Collected& collected);
  void train_now(Lock& lock);
  // These need mutex_.
  [[nodiscard]] bool is_under_way() const;
  void forget_outcome();  // of the lesson before
  [[nodiscard]] Result<> check_free() const;
  // Room for what is marked of this stream: another one's lesson is finished, or there is none.
  Result<> make_room(const Pupil& pupil);
  Result<> check_ready(const std::string& stream, Subject subject) const;
  void begin(const Pupil& pupil, Marked marked, double seconds);
  void forget_all();
  void tell_signs();
  [[nodiscard]] bool is_known(const Pupil& pupil) const;
  [[nodiscard]] v1::TaughtWalk& words_of(Walk walk);
  void forget_so_far();
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
  Marked marked_;
  std::int64_t asked_ns_ = 0;  // for the training
  Subject subject_ = Subject::kStyle;
  std::string name_;  // of what is learnt
  Walks walks_;
  gesture::SignLesson signs_;
  std::optional<TaughtModel> model_;  // for take_model()

  std::thread thread_;
};

}  // namespace posed::teach
