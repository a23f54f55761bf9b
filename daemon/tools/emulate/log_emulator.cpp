#include "daemon/tools/emulate/log_emulator.hpp"

#include <algorithm>
#include <functional>

#include <spdlog/fmt/fmt.h>

#include "daemon/pipeline/record_sink.hpp"
#include "proto/log/reader.hpp"
#include "proto/text/list.hpp"

namespace posed::emulate {

LogEmulator::LogEmulator(Recording recording, std::unique_ptr<drivers::Emulator> speaker)
    : recording_(std::move(recording)), speaker_(std::move(speaker)) {}

void LogEmulator::receive_socket(std::uint8_t socket, std::span<const std::byte> bytes,
                                 std::int64_t now_ns, Bytes& answer) {
  if (!speaker_) return;
  const bool streamed = streams();
  speaker_->receive_socket(socket, bytes, now_ns, answer);
  if (!streamed && streams() && next_ == 0) start_ns_ = now_ns;
}

std::int64_t LogEmulator::next_due_ns() const {
  if (done() || !streams()) return kNoTime_ns;
  return start_ns_ + recording_.arrival_ns(next_) - recording_.arrival_ns(0);
}

void LogEmulator::emit(std::int64_t, Bytes& out) {
  const auto bytes = recording_.bytes(next_++);
  out.insert(out.end(), bytes.begin(), bytes.end());
}

Result<LoggedDevice> read_logged_device(const std::string& log, const std::string& stream,
                                        std::size_t addresses) {
  auto reader = TRY(log::Reader::open(log));
  const log::StreamRow* wanted = nullptr;
  std::string names;
  // The streams of one source are one device.
  const bool one_device =
      std::ranges::adjacent_find(reader.streams(), std::not_equal_to<>(),
                                 &log::StreamRow::source) == reader.streams().end();
  for (const log::StreamRow& row : reader.streams()) {
    add_word(names, row.name);
    if (row.name == stream || (stream.empty() && one_device)) wanted = &row;
  }
  if (wanted == nullptr) {
    return misuse("choose one of its streams with --stream: " + names, log);
  }
  const log::SourceRow& source = reader.source_of(*wanted);
  LoggedDevice device{
      .stream = wanted->name, .driver = source.driver, .text = source.text, .recording = {}};
  std::size_t sockets = 1;
  for (;;) {
    const auto chunk = TRY(reader.next_chunk());
    if (!chunk.has_value()) break;
    const log::ChunkRow& row = *chunk;
    if (row.source != source.id) continue;
    sockets = std::max<std::size_t>(sockets, row.socket + std::size_t{1});
    if (row.direction != static_cast<std::uint8_t>(pipeline::Direction::kFromDevice)) continue;
    device.recording.add(row.arrival_ns, row.bytes, static_cast<std::uint8_t>(row.socket));
  }
  if (device.recording.count() == 0) return fail("nothing came from this stream's device", log);
  if (sockets > addresses) {
    return misuse(fmt::format("it has datagrams of {} sockets of the host; name one address for"
                              " each with --udp, in their order",
                              sockets),
                  log);
  }
  return device;
}

}  // namespace posed::emulate
