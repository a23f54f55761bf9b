// VirtualBodies: the sources of a VirtualDaemon, and the streams of their bodies. It is to the
// SourceBuilder what assembly::Streams is in the daemon, but without threads and sockets.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "daemon/devices/source_builder.hpp"
#include "daemon/pipeline/reader.hpp"
#include "daemon/pipeline/stream_context.hpp"
#include "daemon/pipeline/worker.hpp"
#include "daemon/record/record_rings.hpp"
#include "daemon/record/recorded_stream.hpp"
#include "daemon/system/event_fd.hpp"
#include "proto/message/frame_message.hpp"
#include "tests/support/scripted_device.hpp"
#include "tests/support/temp_folder.hpp"
#include "tests/support/virtual_daemon.hpp"

namespace posed::test {

struct VirtualStreamContext;

// What the publisher of a VirtualDaemon keeps about one stream.
struct PublishedStream {
  PublishedStream(std::uint32_t stream, const std::string& name, pipeline::StreamCounters& counts)
      : id(stream), counters(counts), styled(name), raw(name + "-raw") {}

  // Fails the test if the frame is not sound or goes back.
  void count(const Frame& frame, bool is_raw, bool in_lists);

  std::uint32_t id;
  pipeline::StreamCounters& counters;
  message::FrameEncoder styled, raw;
  VirtualDaemon::Published published;
  bool ended = false;
};

class VirtualBodies final : public devices::StreamHost {
 public:
  // `only` are the devices with one body, which outlive the object; `bodies` is how many streams
  // the bodies of `sources` may have at once.
  VirtualBodies(const std::vector<std::unique_ptr<VirtualStreamContext>>& only,
                std::vector<VirtualSource> sources, std::size_t bodies, std::size_t max_made,
                bool keeps_log);
  ~VirtualBodies() override;

  [[nodiscard]] std::size_t all_slots() const { return all_slots_; }  // of each ring
  [[nodiscard]] pipeline::StreamExchange& exchange() { return *exchange_; }
  // What the streams of a device with one body published, and what was counted for it.
  [[nodiscard]] VirtualDaemon::Published published(std::uint32_t source) const;
  [[nodiscard]] const pipeline::StreamCounters& counters_of(std::uint32_t source) const {
    return counters_[source];
  }
  // All streams of the other bodies that there were, by the time of their end; complete after
  // finish(), empty if no log is kept.
  [[nodiscard]] const std::vector<VirtualBody>& log() const { return log_; }
  [[nodiscard]] std::size_t warnings() const { return warnings_; }

  [[nodiscard]] record::RecordedSetup setup() const;
  // `meanwhile` lets the other parts run while the builder is at work.
  void start(pipeline::Worker& worker, pipeline::Reader& reader, record::RecordRings* record_sink,
             std::function<void()> meanwhile);
  // What control sets for streams.
  [[nodiscard]] devices::KeptSettings& kept() { return kept_; }

  // Whether the reader has bodies or a device to take.
  [[nodiscard]] bool reader_is_called() const;
  [[nodiscard]] std::int64_t supervisor_due_ns() const;
  void supervise();
  // The builder.
  [[nodiscard]] std::int64_t due_ns();
  void turn();

  // The publisher: fails the test if the stream was not added, or was removed.
  [[nodiscard]] PublishedStream& find(std::uint32_t stream);
  void publish_end(PublishedStream& stream);

  // The stream of a body now, by the device's name for it; empty if it has none.
  [[nodiscard]] std::optional<std::uint32_t> stream_of(const std::string& body) const;

  void finish();

 private:
  struct Stream {
    VirtualBody about;
    PublishedStream published;
    std::vector<std::shared_ptr<const StageModel>> models;
    std::unique_ptr<pipeline::StreamContext> context{};  // null for a refused body
  };
  void open_only(VirtualStreamContext& context);
  void open_source(VirtualSource source);
  void open(std::unique_ptr<devices::OpenSource> source, ScriptedDevice& device, std::size_t slots);
  void add_to(pipeline::Reader& reader);
  void keep(std::uint32_t stream, bool left);  // what it published

  // StreamHost
  void is_alive() noexcept override {}
  pipeline::StreamCounters& counters(std::uint32_t stream) override;
  void add(devices::NewStream stream) override;
  std::optional<std::uint32_t> next_gone() override;
  void remove(std::uint32_t stream) override;
  void call_reader() override { reader_->call(); }
  void warn(const devices::OpenSource& source, const std::string& sentence) override;

  const std::vector<std::unique_ptr<VirtualStreamContext>>& only_;
  std::size_t all_slots_ = 0;
  std::unique_ptr<system::EventFd> wake_;
  std::vector<std::unique_ptr<devices::OpenSource>> sources_;  // those with one body first
  std::vector<ScriptedDevice*> devices_;                       // of the sources
  std::vector<std::unique_ptr<ScriptedDevice>> owned_devices_;
  std::vector<std::shared_ptr<const TempFolder>> files_;  // of their configs
  TempFolder model_folder_;
  std::deque<pipeline::StreamCounters> counters_;  // by slot
  std::vector<VirtualDaemon::Published> only_published_;
  std::unique_ptr<pipeline::StreamExchange> exchange_;
  pipeline::Worker* worker_ = nullptr;
  pipeline::Reader* reader_ = nullptr;
  record::RecordRings* record_sink_ = nullptr;
  devices::ModelFiles models_;
  devices::KeptSettings kept_;
  std::function<void()> meanwhile_;
  std::unique_ptr<devices::SourceBuilder> builder_;
  std::int64_t builder_due_ns_ = 0;
  std::map<std::uint32_t, std::unique_ptr<Stream>> streams_;  // those that were not removed
  std::vector<std::uint32_t> gone_;                           // given back by the worker
  std::size_t max_made_;
  bool keeps_log_;
  std::vector<VirtualBody> log_;
  std::size_t warnings_ = 0;
};

}  // namespace posed::test
