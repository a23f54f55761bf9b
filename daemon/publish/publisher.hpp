// Publisher: the one thread that turns the pipeline's items into messages and sends them on a
// ZeroMQ XPUB socket. Topics: pose/<stream>, skeleton/<stream> (soon after a subscription and every
// second), sensor/<stream>, event/<stream>, stats (every second). A slow subscriber does not affect
// the others: its queue is a quarter of a second deep, and messages that do not fit are dropped for
// it alone.
#pragma once

#include <atomic>
#include <functional>
#include <map>
#include <memory>
#include <string>
#include <vector>

#include "daemon/devices/present_device.hpp"
#include "daemon/pipeline/counters.hpp"
#include "daemon/pipeline/messages.hpp"
#include "daemon/pipeline/raw_tap.hpp"
#include "daemon/pipeline/record_sink.hpp"
#include "daemon/pipeline/ring.hpp"
#include "daemon/pipeline/stream_settings.hpp"
#include "daemon/publish/publish_socket.hpp"
#include "daemon/publish/stream_figures.hpp"
#include "daemon/publish/subscriptions.hpp"
#include "daemon/system/event_fd.hpp"
#include "drivers/driver.hpp"
#include "posed/v1/posed.pb.h"
#include "proto/frame/result.hpp"

namespace posed::publish {

class FrameOutput;

// What `stats` tells of a stage beside its numbers.
struct StageInfo {
  const StageType* type = nullptr;
  std::string model{};               // in use, by name; empty: none
  std::vector<std::string> words{};  // that the model knows
  std::map<std::string, std::string, std::less<>>
      texts{};  // the live texts, by ParameterSpec::name
};
// Of the stages, in the order in which they run.
[[nodiscard]] std::vector<StageInfo> stage_infos(const pipeline::StreamSettings& settings);

struct StreamInfo {
  std::uint32_t stream = 0;  // id; its slot is below PublisherOptions::slots
  std::string name;
  drivers::Description description;
  // Of the frames as published; Description::skeleton is the source's own.
  std::shared_ptr<const Skeleton> skeleton;
  double rate_hz = 0.0;           // expected frame rate; 0: unknown
  std::vector<StageInfo> stages;  // at the start, in the order in which they run
  bool raw = false;               // the unstyled input is published as <name>-raw
  bool comes_and_goes = false;    // the device may be unplugged
  std::shared_ptr<const devices::PresentDevice> present{};  // null: the stream has no device
  // Never null. They outlive the publisher, or Publisher::remove() of the stream.
  pipeline::StreamCounters* counters = nullptr;
  const pipeline::SourceCounters* source_counters = nullptr;
  // Of a body of a device with several: the source's name in the config, and the device's own name
  // for the body.
  std::string source{}, body{};
  std::string remark{};     // of the driver about the body; may be empty
  std::int32_t number = 0;  // drivers::Body::number
  std::string refusal{};    // why a stage cannot serve the body; then nothing is ever published
};

// A device with several bodies, for the stats.
struct SourceInfo {
  std::string name;
  std::string driver;
  bool comes_and_goes = false;  // the device may be unplugged
  std::shared_ptr<const devices::PresentDevice> present{};
  const pipeline::SourceCounters* counters = nullptr;  // outlive the publisher
};

struct PublisherOptions {
  void* context = nullptr;  // the ZeroMQ context; outlives the publisher
  std::string endpoint;
  // Checks every subscriber; null (in tests): all are admitted, even with ZMTP before 3.0.
  net::ZapAuthenticator* authenticator = nullptr;
  std::string secret_z85;                       // the server's key; empty: no CURVE
  std::function<void(v1::Stats&)> more_stats;   // adds the recorder's counters; may be empty
  pipeline::RecordSink* record_sink = nullptr;  // null: no recording
  pipeline::RawTap* raw_tap = nullptr;          // null: nobody else wants the frames before stages
  Clock clock = nullptr;                        // the host's; times what is sent every second
  // The clock for the times of published frames, events and stats. Empty: `clock`. A replay
  // publishes in the time of its recording.
  std::function<std::int64_t()> data_clock{};
  bool stamps = true;           // false: leaves published_ns out, because it would have no meaning
  std::size_t slots = 0;        // how many streams there may be at once
  double messages_per_s = 0.0;  // of all streams that there may be
  std::vector<SourceInfo> sources{};
  // Which get the streams that they want; outlive the publisher.
  std::vector<FrameOutput*> outputs{};
};

class PublishedSlots;
class PublishedStream;

class Publisher {
 public:
  // Binds. `in` and `wake` outlive the publisher.
  static Result<std::unique_ptr<Publisher>> open(PublisherOptions options,
                                                 pipeline::Ring<pipeline::Item>& in,
                                                 system::EventFd& wake);
  ~Publisher();

  [[nodiscard]] const std::string& endpoint() const noexcept;  // the endpoint that is really bound

  // Does everything that is due at `now_ns` (of the options' clock) and never waits. Returns the
  // latest time of the next call; call earlier if the EventFd is notified or the socket is
  // readable.
  [[nodiscard]] std::int64_t turn(std::int64_t now_ns);
  // The last turn: sends the items that still wait, and the final counts.
  void finish(std::int64_t now_ns);
  // One turn after another until stop(), then finish(). The calling thread becomes the publisher
  // thread.
  void run();

  // All below: for any other thread; cold.
  void stop() noexcept;
  // Of the thread in run().
  [[nodiscard]] const system::Pulse& pulse() const noexcept { return pulse_; }
  // A stream comes. It is there at the publisher's next turn, at once if no thread is in run(); but
  // if its slot still has an earlier generation, at its own first item, or when the earlier one is
  // removed.
  void add(StreamInfo stream);
  // The stream leaves; nothing happens if there is none of this id. Waits until everything that is
  // in the ring now has been taken, and until nothing uses the stream's counters any more. If no
  // thread is in run(), the caller does all that itself; so if turn() is used without run(), then
  // only the thread that calls turn() may call remove().
  void remove(std::uint32_t stream);
  // The same stages with other models or texts.
  void set_stages(std::uint32_t stream, std::vector<StageInfo> stages);
  // Publishes a message for people on event/<stream>.
  void post_event(std::uint32_t stream, v1::Event::Kind kind, std::string text);
  // Disconnects subscribers that are no longer allowed (a key was withdrawn); needs an
  // authenticator.
  void check_subscribers();
  // Rates and percentiles are those of the last full second; everything else is current.
  [[nodiscard]] v1::Stats stats() const;
  // What was counted since the start, of the streams that are there now.
  [[nodiscard]] std::vector<StreamFigures> figures() const;
  // Of the subscribers.
  [[nodiscard]] const net::PeerGuard& guard() const noexcept { return socket_.guard(); }

 private:
  struct Requests;
  Publisher(PublisherOptions options, pipeline::Ring<pipeline::Item>& in, system::EventFd& wake,
            PublishSocket socket, std::unique_ptr<system::Poller> poller);
  void handle_all();
  void handle(const pipeline::Item& item);
  void handle_frame(PublishedStream& published, const Frame& frame, bool raw);
  void handle_notice(PublishedStream& published, const pipeline::StreamEvent& event);
  // The stream of an item; null if there is none.
  [[nodiscard]] PublishedStream* stream_of(const pipeline::Item& item);
  void report_shed(PublishedStream& published, bool at_end);
  void send_event(PublishedStream& published, v1::Event::Kind kind, std::int64_t time_ns,
                  std::uint64_t sequence, const std::string& text);
  // Sends the skeletons of the streams that have come, and says that they have.
  void announce_new();
  // Sends the skeletons that are due; returns when the next one is.
  [[nodiscard]] std::int64_t send_skeletons(std::int64_t now_ns);
  void want_skeletons(std::string_view prefix);
  // The stream has got its slot.
  void connect_outputs(PublishedStream& published);
  [[nodiscard]] bool is_topic(std::string_view prefix) const;
  void every_second(std::int64_t now_ns);
  // Call after the streams were added, because a source says how many it has.
  void add_sources(v1::Stats& stats) const;
  void add_outputs(v1::Stats& stats) const;
  [[nodiscard]] bool asked() const noexcept;
  void do_what_was_asked();
  void remove_now(std::uint32_t stream);
  void begin_serving();
  void end_serving();
  void keep_stats(v1::Stats stats);
  template <typename Change>
  void ask(Change&& change);
  void send(std::string_view topic, const google::protobuf::MessageLite& message);

  PublisherOptions options_;
  pipeline::Ring<pipeline::Item>& in_;
  system::EventFd& wake_;
  PublishSocket socket_;
  Subscriptions subscriptions_;
  std::unique_ptr<system::Poller> poller_;
  std::unique_ptr<PublishedSlots> slots_;
  std::unique_ptr<Requests> requests_;
  // When stats were last published, and the processor time at that moment.
  std::int64_t reported_ns_ = kNoTime_ns;
  std::int64_t reported_cpu_ns_ = 0;
  std::string scratch_;
  system::Pulse pulse_;
  std::atomic<bool> stop_{false};
};

}  // namespace posed::publish
