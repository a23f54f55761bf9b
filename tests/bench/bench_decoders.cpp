// `posed_bench decoders`: how many packets a second each glove's decoder handles on one core, and
// what it adds to a bare read() of the same pseudo-terminal.
#include <poll.h>
#include <unistd.h>

#include <algorithm>
#include <array>
#include <atomic>
#include <chrono>
#include <cmath>
#include <cstddef>
#include <cstdio>
#include <memory>
#include <numbers>
#include <string>
#include <thread>
#include <vector>

#include <spdlog/fmt/fmt.h>
#include <CLI/CLI.hpp>
#include <nlohmann/json.hpp>

#include "daemon/pipeline/ring.hpp"
#include "daemon/system/clock.hpp"
#include "daemon/tools/command/command.hpp"
#include "daemon/tools/emulate/emulated_device.hpp"
#include "drivers/described/device_file.hpp"
#include "drivers/driver.hpp"
#include "drivers/glove/glove_emulator.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "proto/frame/result.hpp"
#include "proto/text/json_text.hpp"
#include "tests/bench/bench.hpp"
#include "tests/bench/percentiles.hpp"
#include "tests/support/processor_time.hpp"

namespace posed::bench {

namespace {

using nlohmann::json;
using system::monotonic_ns;
using Bytes = std::vector<std::byte>;

struct BenchGlove {
  std::string name;                             // "described vmg30"
  std::unique_ptr<drivers::Emulator> emulator;  // already streaming
  std::unique_ptr<drivers::Decoder> decoder;
};

using drivers::Driver;
using drivers::Emulator;
using drivers::Options;

// Lends an emulator to code that wants to own one.
class LentEmulator final : public Emulator {
 public:
  explicit LentEmulator(Emulator& emulator) : emulator_(emulator) {}
  void pose(std::size_t body, const Frame& frame) override { emulator_.pose(body, frame); }
  void receive(std::span<const std::byte> bytes, std::int64_t now_ns, Bytes& answer) override {
    emulator_.receive(bytes, now_ns, answer);
  }
  [[nodiscard]] std::int64_t next_due_ns() const override { return emulator_.next_due_ns(); }
  void emit(std::int64_t now_ns, Bytes& out) override { emulator_.emit(now_ns, out); }

 private:
  Emulator& emulator_;
};

// The driver opens the emulator as it would open the glove; afterwards the emulator streams.
Result<std::unique_ptr<drivers::Decoder>> opened_decoder(const Driver& driver, Options options,
                                                         Emulator& emulator) {
  auto port = TRY(emulate::EmulatedPort::open_pty());
  options["port"] = port.name();
  emulate::EmulatedDevice glove(std::make_unique<LentEmulator>(emulator), std::move(port), {}, {});
  const std::jthread thread([&](const std::stop_token& stop) { glove.run(stop); });
  drivers::TransportFactory ports;
  auto device = TRY(driver.open(options, ports));
  return std::move(device.decoder);
}

Result<std::unique_ptr<drivers::Decoder>> expected_decoder(const Driver& driver,
                                                           const Options& options) {
  const auto description = TRY(driver.expect(options));
  return driver.make_decoder(description);
}

Result<BenchGlove> make_bench_glove(const Driver& driver, const std::string& name,
                                    const Options& options) {
  auto emulator = TRY(driver.emulate(options));
  auto decoder =
      TRY(emulator->next_due_ns() == kNoTime_ns ? opened_decoder(driver, options, *emulator)
                                                : expected_decoder(driver, options));
  return BenchGlove{name, std::move(emulator), std::move(decoder)};
}

// The variants of a driver's gloves that differ in their bytes.
std::vector<std::pair<std::string, Options>> glove_kinds(const Driver& driver) {
  const std::string name(driver.name);
  std::vector<std::pair<std::string, Options>> found;
  if (name != "described") found.push_back({name, {}});
  if (name == "cyberglove") found.push_back({name + " 16bit", {{"form", std::string("16bit")}}});
  if (name == "fivedt") found.push_back({name + " 16", {{"model", std::string("16")}}});
  if (name == "lucidgloves") {
    found.push_back({name + " legacy", {{"encoding", std::string("legacy")}}});
  }
  if (name != "described") return found;
  for (const std::string& device : drivers::described::shipped_devices()) {
    found.push_back({fmt::format("{} {}", name, device), {{"device", device}}});
  }
  return found;
}

// One of every driver that can be emulated, and one of every table-driven device. If a glove
// streams only on command, its driver has sent that command through a pseudo-terminal.
Result<std::vector<BenchGlove>> bench_gloves() {
  std::vector<BenchGlove> gloves;
  for (const Driver& driver : drivers::registry()) {
    if (driver.glove == nullptr || driver.emulate == nullptr) continue;
    for (const auto& [name, options] : glove_kinds(driver)) {
      auto glove = TRY(make_bench_glove(driver, name, options));
      gloves.push_back(std::move(glove));
    }
  }
  return gloves;
}

// Adds the glove's next record to `out`, for a hand that closes and opens every 64 records.
void next_record(BenchGlove& glove, std::size_t index, std::vector<std::byte>& out) {
  constexpr double kRecordsATurn = 64.0;
  HandAngles angles{};
  const double turn = 2.0 * std::numbers::pi * static_cast<double>(index) / kRecordsATurn;
  for (std::size_t i = 0; i < angles.size(); i += 3) angles[i] = 0.5 - 0.5 * std::cos(turn);
  glove.emulator->pose(0, drivers::glove::hand_frame(angles));
  glove.emulator->emit(glove.emulator->next_due_ns(), out);
}

constexpr std::size_t kLoopRecords = 512;  // of the data that is decoded repeatedly
constexpr std::size_t kReadBytes = 4096;   // most bytes of a read
constexpr auto kPacketPause = std::chrono::milliseconds(1);
constexpr const char* kDecodersFooter =
    R"(Every glove that posed can emulate, its bytes as the emulator sends them.
packets/s: decoded, calibrated, posed and put into a ring, by CPU time of one thread.
latency: from before the write of a whole packet into a pseudo-terminal to its read() (bare) or to
its frame in a ring (decoded); packets take turns between the two, one a millisecond.

  posed_bench decoders
  posed_bench decoders --glove cyberglove --samples 500 --json)";

// Does what a reader's sink does: puts items into a ring.
class RingSink final : public Sink {
 public:
  void frame(std::size_t /*body*/, Frame& frame) noexcept override {
    static_cast<void>(ring_.push(frame));
    ++frames;
  }
  void sample(std::size_t /*body*/, Sample& /*sample*/) noexcept override { ++samples; }
  void outcome(Outcome outcome) noexcept override { bad += outcome == Outcome::kOk ? 0 : 1; }
  void empty_ring() noexcept {
    while (ring_.consume([](Frame&) {})) {
    }
  }
  std::uint64_t frames = 0, samples = 0, bad = 0;

 private:
  pipeline::Ring<Frame> ring_{256};
};

json decoder_rate(BenchGlove& glove) {
  Bytes bytes;
  for (std::size_t i = 0; i < kLoopRecords; ++i) next_record(glove, i, bytes);
  RingSink sink;
  const std::span<const std::byte> all(bytes);
  const double start_us = test::processor_time_us();
  double took_s = 0.0;
  while (took_s < 0.5) {
    for (std::size_t at = 0; at < all.size(); at += kReadBytes) {
      glove.decoder->feed(all.subspan(at, std::min(kReadBytes, all.size() - at)), 0, sink);
      sink.empty_ring();
    }
    took_s = 1e-6 * (test::processor_time_us() - start_us);
  }
  return {{"record_bytes", bytes.size() / kLoopRecords},
          {"packets_per_s", static_cast<double>(sink.samples) / took_s},
          {"frames_per_s", static_cast<double>(sink.frames) / took_s},
          {"damaged", sink.bad}};
}

// Both ends of a pseudo-terminal, and when the current packet was written.
struct BenchLine {
  emulate::EmulatedPort port;
  std::unique_ptr<drivers::Transport> host;
  std::atomic<std::int64_t> written_ns{0};
};

// Waits for the packet and reads it, with or without the decoder; 0 if none came.
std::int64_t take_record(BenchLine& line, std::size_t bytes, drivers::Decoder* decoder,
                         RingSink& sink) {
  std::array<std::byte, kReadBytes> buffer{};
  while (bytes > 0) {
    pollfd wait{line.host->poll_fd(), POLLIN, 0};
    if (::poll(&wait, 1, 1000) <= 0) return 0;
    std::size_t got = 0;
    if (decoder == nullptr) {
      const ssize_t size = ::read(wait.fd, buffer.data(), buffer.size());
      got = size > 0 ? static_cast<std::size_t>(size) : 0;
    } else {
      const drivers::Chunk chunk = line.host->read(monotonic_ns());
      decoder->feed(chunk.bytes, 0, sink);
      got = chunk.bytes.size();
    }
    if (got == 0) return 0;
    bytes -= std::min(bytes, got);
  }
  return monotonic_ns();
}

Result<json> decoder_latency(BenchGlove& glove, int samples) {
  auto port = TRY(emulate::EmulatedPort::open_pty());
  drivers::TransportFactory ports;
  auto link = TRY(ports.serial({.port = port.name()}));
  BenchLine line{std::move(port), drivers::make_link_transport(std::move(link))};
  std::vector<double> bare_us, decoded_us;
  RingSink sink;
  std::atomic<int> wanted{0};
  std::atomic<std::size_t> size{0};
  std::jthread glove_side([&](const std::stop_token& stop) {
    Bytes record;
    for (int sent = 0; !stop.stop_requested(); std::this_thread::sleep_for(kPacketPause)) {
      if (wanted.load() == sent) continue;
      record.clear();
      next_record(glove, static_cast<std::size_t>(++sent), record);
      size.store(record.size());
      line.written_ns.store(monotonic_ns());
      line.port.send(0, record);
    }
  });
  for (int i = 0; i < 2 * samples; ++i) {
    const bool decode = i % 2 == 1;
    const std::uint64_t before = sink.samples;
    wanted.fetch_add(1);
    pollfd wait{line.host->poll_fd(), POLLIN, 0};
    if (::poll(&wait, 1, 1000) <= 0) return fail("the pseudo-terminal gives nothing");
    const std::int64_t done_ns =
        take_record(line, size.load(), decode ? glove.decoder.get() : nullptr, sink);
    sink.empty_ring();
    if (done_ns == 0) return fail("a packet did not come through the pseudo-terminal");
    // the stream began in the middle of a packet that was skipped
    if (decode && sink.samples == before) continue;
    (decode ? decoded_us : bare_us)
        .push_back(static_cast<double>(done_ns - line.written_ns.load()) * 1e-3);
  }
  json report{{"bare_read", percentiles(bare_us)}, {"decoded", percentiles(decoded_us)}};
  report["p99_ratio"] =
      report["decoded"]["p99_us"].get<double>() / report["bare_read"]["p99_us"].get<double>();
  return report;
}

void print_glove(const json& glove) {
  const json& rate = glove["throughput"];
  std::printf("%-28s %4llu bytes %6.2f M packets/s", glove["glove"].get<std::string>().c_str(),
              static_cast<unsigned long long>(rate["record_bytes"].get<std::uint64_t>()),
              rate["packets_per_s"].get<double>() * 1e-6);
  for (const char* const way : {"bare_read", "decoded"}) {
    const json& us = glove["latency"][way];
    std::printf("  %s %5.1f %5.1f %6.1f %6.1f", way, us["p50_us"].get<double>(),
                us["p99_us"].get<double>(), us["p99_9_us"].get<double>(),
                us["max_us"].get<double>());
  }
  std::printf("  p99 x%.2f\n", glove["latency"]["p99_ratio"].get<double>());
}

struct DecoderBench {
  std::string glove;
  int samples = 2000;
  bool json = false;
};

Result<> bench_decoders(const DecoderBench& bench) {
  json report = json::array();
  if (!bench.json) std::printf("latency in us: p50, p99, p99.9, max\n");
  auto gloves = TRY(bench_gloves());
  for (BenchGlove& glove : gloves) {
    if (!glove.name.starts_with(bench.glove)) continue;
    json entry{{"glove", glove.name}, {"throughput", decoder_rate(glove)}};
    auto ways = TRY(decoder_latency(glove, bench.samples));
    entry["latency"] = std::move(ways);
    if (!bench.json) print_glove(entry);
    report.push_back(std::move(entry));
  }
  if (report.empty())
    return misuse("there is no glove '" + bench.glove + "'; leave --glove out to see them");
  if (bench.json) std::printf("%s\n", json_text(report, 2).c_str());
  return {};
}

}  // namespace

void add_bench_decoders(CLI::App& bench, int& exit_code) {
  const auto options = std::make_shared<DecoderBench>();
  CLI::App* command = bench.add_subcommand("decoders", "The decoders of all gloves");
  command->footer(kDecodersFooter);
  command->add_option("--glove", options->glove, "Only gloves whose name begins with this");
  command->add_option("--samples", options->samples, "Timed packets for each glove and way")
      ->check(CLI::Range(10, 1'000'000))
      ->capture_default_str();
  command->add_flag("--json", options->json, "One JSON array on stdout");
  command->callback([options, &exit_code] { exit_code = tools::report(bench_decoders(*options)); });
}

}  // namespace posed::bench
