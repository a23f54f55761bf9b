// VirtualBodies: the sources of a VirtualDaemon, and the streams of their bodies. It is to the
// SourceBuilder what assembly::BodyStreams is in the daemon, but without threads and sockets.
#pragma once

#include <cstdint>
#include <deque>
#include <functional>
#include <map>
#include <memory>
#include <optional>
#include <set>
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
#include "tests/support/virtual_daemon.hpp"

namespace posed::test {

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
  // `first` is the number of the first source and the slot of the first stream.
  VirtualBodies(std::vector<VirtualSource> sources, std::uint32_t first, std::size_t streams,
                bool keeps_log);
  ~VirtualBodies() override;

  [[nodiscard]] std::size_t streams() const { return counters_.size(); }
  [[nodiscard]] std::size_t all_slots() const { return streams() * (slots_ + 1); }
  [[nodiscard]] pipeline::StreamExchange& exchange() { return *exchange_; }
  // All streams that there were, by the time of their end; complete after finish(), empty if no
  // log is kept.
  [[nodiscard]] const std::vector<VirtualBody>& log() const { return log_; }
  [[nodiscard]] std::size_t warnings() const { return warnings_; }

  void add_to(record::RecordedSetup& setup) const;
  void add_to(pipeline::Reader& reader);
  // `meanwhile` lets the other parts run while the builder is at work.
  void start(pipeline::Worker& worker, pipeline::Reader& reader, record::RecordRings* record_sink,
             std::set<std::string> reserved, pipeline::PartnerStreams partners,
             std::function<void()> meanwhile);

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
    std::vector<std::unique_ptr<const StageModel>> models;
    std::unique_ptr<pipeline::StreamContext> context{};  // null for a refused body
  };
  void keep(std::uint32_t stream, bool left);  // in log_

  // StreamHost
  pipeline::StreamCounters& counters(std::uint32_t stream) override;
  [[nodiscard]] std::size_t decoded_slots() const override { return slots_; }
  void add(devices::NewStream stream) override;
  std::optional<std::uint32_t> take_gone() override;
  void remove(std::uint32_t stream) override;
  void call_reader() override { reader_->call(); }
  void warn(const devices::BodySource& source, const std::string& sentence) override;

  std::uint32_t first_;
  std::size_t slots_ = 0;  // of one stream, in each ring
  std::unique_ptr<system::EventFd> wake_;
  std::vector<std::unique_ptr<devices::BodySource>> sources_;
  std::vector<std::unique_ptr<ScriptedDevice>> devices_;  // of the sources
  std::vector<std::shared_ptr<const TempFolder>> files_;  // of their configs
  std::deque<pipeline::StreamCounters> counters_;         // by slot, from first_ on
  std::unique_ptr<pipeline::StreamExchange> exchange_;
  pipeline::Worker* worker_ = nullptr;
  pipeline::Reader* reader_ = nullptr;
  record::RecordRings* record_sink_ = nullptr;
  devices::ModelFiles models_;
  pipeline::PartnerStreams partners_;  // that stages may name
  std::function<void()> meanwhile_;
  std::unique_ptr<devices::SourceBuilder> builder_;
  std::int64_t builder_due_ns_ = 0;
  std::map<std::uint32_t, std::unique_ptr<Stream>> streams_;  // those that were not removed
  std::vector<std::uint32_t> gone_;                           // given back by the worker
  bool keeps_log_;
  std::vector<VirtualBody> log_;
  std::size_t warnings_ = 0;
};

}  // namespace posed::test
