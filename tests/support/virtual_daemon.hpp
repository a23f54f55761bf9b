// VirtualDaemon: the daemon's reader, pipeline and recorder in one thread on a virtual clock, which
// advances without waiting. Devices follow a script. The order of the parts' turns, the duration of
// a turn and the times at which a part is held up are drawn from a seed, so a failed run can be
// repeated. It records a real device log with the published frames, to test `replay --expect`.
//
//   VirtualDaemon daemon({.seed = 7, .log = folder.path() / "take.plog"});
//   daemon.add(walking_stream("walker", 3.0));
//   daemon.add(glove_stream("hand", 3.0));
//   daemon.command({.at_s = 1.0, .kind = VirtualCommand::Kind::kAlpha, .alpha = 0.5F});
//   daemon.run(3.5);  // the log is closed now
//
// Times are seconds since the start of the run. Only one at a time in a thread, because all use the
// same clock.
#pragma once

#include <cstdint>
#include <filesystem>
#include <functional>
#include <limits>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "daemon/config/daemon_config.hpp"
#include "daemon/pipeline/counters.hpp"
#include "daemon/pipeline/messages.hpp"
#include "daemon/record/record_rings.hpp"
#include "daemon/record/stream_settings.hpp"
#include "drivers/driver.hpp"
#include "tests/support/temp_folder.hpp"

namespace posed::test {

inline constexpr double kNever_s = std::numeric_limits<double>::infinity();

// What one read of the device returns.
struct ScriptedChunk {
  double at_s = 0.0;
  std::string bytes;
};

// One link to a device, from its connection to its loss. Several in order are a device that is
// unplugged and plugged in again.
struct ScriptedLink {
  double from_s = 0.0;
  std::vector<ScriptedChunk> chunks;  // by time
  double until_s = kNever_s;
  bool ends = false;  // at `until_s` the source ends, and no other link follows
  // every read from `from_s` to `until_s` returns this: a device without a pause
  std::string flood;
};

// A stream and everything that it needs; made by the functions below or by hand.
struct VirtualStream {
  std::string name;
  drivers::Description description;      // of a driver in the registry
  record::StreamSettings settings;       // rate_hz and the models are set by the VirtualDaemon
  std::vector<std::string> model_files;  // one for each stage: bytes of its model file, or empty
  std::string calibration;               // TOML; empty: the device's default
  std::vector<ScriptedLink> links;
  double repeat_s = kNever_s;  // every so often the script of links begins again
  std::size_t slots = 64;      // how many slots of each ring the stream may fill
};

// A device with several bodies, whose streams come and go.
struct VirtualSource {
  config::SourceConfig config;
  std::vector<ScriptedLink> links;
  double repeat_s = kNever_s;
  drivers::Poll poll{};
  std::size_t slots = 64;                   // how many slots of each ring each body may fill
  std::vector<std::string> bodies{};        // names of all that the script describes
  std::shared_ptr<const TempFolder> files;  // of the config
};

// A command that a client sends during the run.
struct VirtualCommand {
  enum class Kind : std::uint8_t { kAlpha, kModel, kPlay, kStopPlaying, kCalibrate };
  double at_s = 0.0;
  std::uint32_t stream = 0;
  Kind kind = Kind::kAlpha;
  float alpha = 0.0F;
  std::string bytes{};   // kModel: a model file, for the stage that takes it; kCalibrate: TOML
  std::string labels{};  // kPlay: names of labels
  // kAlpha: for the stream of this body instead, if there is one at that time.
  std::string body{};
  bool loop = false;  // kPlay
};

// From one time to another.
struct Spell {
  double from_s = 0.0, until_s = 0.0;
};

struct VirtualOptions {
  std::uint64_t seed = 1;
  std::filesystem::path log;  // empty: no recording
  bool holdups = true;        // the parts are held up from time to time, for up to 0.4 s
  int turns_between_holdups = 400;
  double calm_from_s = kNever_s;  // no holdup begins after this
  double turn_us = 40.0;          // the longest duration of a turn
  // Nothing can be written to the disk. Ends before the run does.
  std::vector<Spell> disk_full{};
  // The computer sleeps: nothing has a turn, and time goes on.
  std::vector<Spell> asleep{};
  // The process ends there as if by SIGKILL, so the log is as its last commit left it.
  double killed_at_s = kNever_s;
  std::size_t ack_slots = 64;     // of the ring to control
  std::size_t bodies = 8;         // of all sources that may have a stream at once
  std::size_t max_made = 60'000;  // streams that are made without a pause
  // Each device's and each stream's share of the recorder's rings.
  std::size_t chunk_bytes = 4 << 20;
  record::SlotSizes record_slot{.frame_bytes = 16 << 20, .decisions = 2048};
  // Keeps counts, but no lists of what was published and acknowledged: for runs of days.
  bool counts_only = false;
  double look_every_s = kNever_s;
  std::function<void(double at_s)> look{};
};

struct VirtualBody;

class VirtualDaemon {
 public:
  explicit VirtualDaemon(VirtualOptions options);
  ~VirtualDaemon();

  // Call before run(); streams are numbered in the order in which they are added.
  void add(VirtualStream stream);
  void add(VirtualSource source);
  void command(VirtualCommand command);

  // Runs from time 0 to `until_s`, stops as the daemon does and closes the log, unless it is killed
  // before. Call once. Fails the test if something cannot be set up, or if a published frame has a
  // rotation that is not of length 1 or a number that is not finite.
  void run(double until_s);

  struct Published {
    std::uint64_t frames = 0, raw = 0, samples = 0;
    std::uint64_t newest = 0, numbers = 0;  // sequences of styled frames: the last; how many
    std::uint64_t missed = 0;               // numbers of frames that never came, as events said
    std::vector<std::uint64_t> sequences;   // of the styled frames, as they came
    std::vector<double> at_s;               // of each of them, when it was published
    std::set<long> root_z_m;                // rounded, of all frames

    // Adds what the next stream of the same name published.
    Published& operator+=(const Published& next);
  };
  // Of a stream with a device of its own, so far.
  [[nodiscard]] Published published(std::uint32_t stream) const;
  [[nodiscard]] const pipeline::StreamCounters& counters(std::uint32_t stream) const;
  // After run(): all streams that bodies of sources ever had, those of one slot in order.
  [[nodiscard]] const std::vector<VirtualBody>& bodies() const;
  // How often people were told of a problem with a source.
  [[nodiscard]] std::size_t warnings() const;
  // How often the recorder could not write.
  [[nodiscard]] std::uint64_t write_errors() const;
  // The Acks that control received; tickets count the commands from 1, by time.
  [[nodiscard]] const std::vector<pipeline::Ack>& acks() const;

 private:
  class Parts;
  std::unique_ptr<Parts> parts_;
};

// A stream that the body of a source had.
struct VirtualBody {
  std::uint32_t stream = 0;
  std::string source, body, name{};
  std::string refusal{};  // empty: it was streamed
  VirtualDaemon::Published published{};
  bool left = false;          // before the end of the run
  std::uint64_t decoded = 0;  // sequence of the last frame of its name, decoded by its end
  // Frames that were dropped or shed, and items for which there was no space on the way to the
  // publisher; those of earlier streams of the same name in its slot are included.
  std::uint64_t lost = 0, unpublished = 0;
};

// A body of five joints that walks at 60 Hz, with style, generate (a lag of one frame) and raw
// frames.
[[nodiscard]] VirtualStream walking_stream(const std::string& name, double length_s,
                                           unsigned style_seed = 1);
// A LucidGlove at 100 Hz whose decoder gives a sample before each frame, with generate
// (a lag of two frames, with a gesture model) and constrain.
[[nodiscard]] VirtualStream glove_stream(const std::string& name, double length_s,
                                         Side side = Side::kRight);

// A room with two to six people at 60 to 120 Hz who come and go and change their skeleton, and
// whose system repeats, cuts, distorts or floods its descriptions. What happens, and the stages of
// the bodies, are drawn from the seed. The root of each is z metres away, where z is the system's
// number for the person; a person may get a new one, but nobody that of another.
[[nodiscard]] VirtualSource mocap_source(const std::string& name, double length_s,
                                         std::uint64_t seed);

// One person at 50 Hz, named by the config as the source is, who leaves at half of `back_s`,
// returns then and stays.
[[nodiscard]] VirtualSource guest_source(const std::string& name, double back_s, double end_s);

// Inserts silences, unplugs (on streams with a glove) and bursts into the stream's only link, at
// random.
void disturb(VirtualStream& stream, std::uint64_t seed);
void disturb(VirtualSource& source, std::uint64_t seed);

// A calibration for the glove of glove_stream(); each `variant` is different.
[[nodiscard]] std::string glove_calibration(int variant);

}  // namespace posed::test
