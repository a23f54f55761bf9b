#include <array>
#include <cstddef>
#include <cstdint>
#include <filesystem>
#include <string>
#include <string_view>
#include <system_error>

#include "daemon/metrics/figures.hpp"
#include "daemon/metrics/text_format.hpp"
#include "daemon/system/process.hpp"
#include "proto/frame/sink.hpp"

namespace posed::metrics {
namespace {

using publish::StreamFigures;

constexpr std::array<std::string_view, 5> kStates{"waiting", "live", "stale", "ended", "refused"};

double one_if(bool yes) { return yes ? 1.0 : 0.0; }

void write_frames(const Figures& figures, TextFormat& text) {
  text.counter("posed_decoded_frames_total", "Frames that the stream's device gave.");
  for (const StreamFigures& stream : figures.streams) {
    text.sample({{"stream", stream.stream}}, stream.decoded);
  }
  text.counter("posed_frames_total",
               "Frames published; a stale stream repeats its last one each second.");
  for (const StreamFigures& stream : figures.streams) {
    for (std::size_t i = 0; i < stream.published.size(); ++i) {
      text.sample({{"stream", stream.stream}, {"quality", publish::kQualityNames[i]}},
                  stream.published[i]);
    }
  }
  text.counter("posed_silences_total", "How often a stream's device fell silent.");
  for (const StreamFigures& stream : figures.streams) {
    text.sample({{"stream", stream.stream}}, stream.silences);
  }
  text.counter("posed_left_frames_total", "Frames published of streams that have left.");
  text.sample({}, figures.stats.left_frames());
}

void write_times(const Figures& figures, TextFormat& text) {
  text.gauge("posed_frame_period_seconds", "Time between two frames as the device states it.");
  for (const StreamFigures& stream : figures.streams) {
    if (stream.rate_hz > 0.0) text.sample({{"stream", stream.stream}}, 1.0 / stream.rate_hz);
  }
  text.histogram("posed_decode_seconds", "From a frame's arrival until it was decoded.");
  for (const StreamFigures& stream : figures.streams) {
    text.sample({{"stream", stream.stream}}, stream.decode);
  }
  text.histogram("posed_stage_seconds", "Time of a frame in a stage.");
  for (const StreamFigures& stream : figures.streams) {
    for (const auto& [stage, times] : stream.stages) {
      text.sample({{"stream", stream.stream}, {"stage", stage}}, times);
    }
  }
  text.histogram("posed_latency_seconds",
                 "From a frame's arrival until it was handed out, with the stages' lag.");
  for (const StreamFigures& stream : figures.streams) {
    text.sample({{"stream", stream.stream}}, stream.publish);
  }
}

// One family with a value of each stream.
template <typename Value>
void write_each(const v1::Stats& stats, TextFormat& text, Value value) {
  for (const v1::StreamStats& stream : stats.stream()) {
    text.sample({{"stream", stream.stream()}}, value(stream));
  }
}

void write_streams(const v1::Stats& stats, TextFormat& text) {
  text.gauge("posed_stream_info", "Which driver or source a stream has; always 1.");
  for (const v1::StreamStats& stream : stats.stream()) {
    text.sample({{"stream", stream.stream()},
                 {"driver", stream.driver()},
                 {"source", stream.source_name()}},
                1.0);
  }
  text.gauge("posed_stream_state", "1 for the state that the stream has, 0 for the others.");
  for (const v1::StreamStats& stream : stats.stream()) {
    for (const std::string_view state : kStates) {
      text.sample({{"stream", stream.stream()}, {"state", state}}, one_if(stream.state() == state));
    }
  }
  text.counter("posed_samples_total", "Samples of sensors published.");
  write_each(stats, text, [](const auto& stream) { return std::uint64_t{stream.samples()}; });
  text.counter("posed_shed_total", "Frames and samples skipped because newer ones waited.");
  write_each(stats, text, [](const auto& stream) { return std::uint64_t{stream.shed()}; });
  text.counter("posed_dropped_total", "Frames and samples for which a ring was full.");
  write_each(stats, text, [](const auto& stream) { return std::uint64_t{stream.dropped()}; });
  text.gauge("posed_lag_frames", "Frames that the stages hold back to smooth.");
  write_each(stats, text, [](const auto& stream) { return std::uint64_t{stream.lag_frames()}; });
  text.gauge("posed_lag_seconds", "The same as a time.");
  write_each(stats, text, [](const auto& stream) { return stream.lag_ms() * 1e-3; });
}

// A device with one body has the name of its stream, one with several that of its source.
template <typename Use>
void for_each_device(const v1::Stats& stats, Use&& use) {
  for (const v1::StreamStats& stream : stats.stream()) {
    if (stream.source_name().empty()) use(stream.stream(), stream);
  }
  for (const v1::SourceStats& source : stats.source()) use(source.name(), source);
}

void write_devices(const v1::Stats& stats, TextFormat& text) {
  text.gauge("posed_device_up", "Whether the device is connected.");
  for_each_device(stats, [&](const std::string& name, const auto& device) {
    text.sample({{"device", name}, {"driver", device.driver()}}, one_if(!device.away()));
  });
  text.counter("posed_device_connections_total", "Connections to the device.");
  for_each_device(stats, [&](const std::string& name, const auto& device) {
    text.sample({{"device", name}}, std::uint64_t{device.connections()});
  });
  text.counter("posed_packets_total", "Packets of the device, by what became of them.");
  for_each_device(stats, [&](const std::string& name, const auto& device) {
    for (int i = 0; i < device.outcome_size() && i < kOutcomes; ++i) {
      text.sample({{"device", name}, {"outcome", kOutcomeNames[i]}},
                  std::uint64_t{device.outcome(i)});
    }
  });
  text.counter("posed_kernel_dropped_total", "Datagrams that posed did not read in time.");
  for_each_device(stats, [&](const std::string& name, const auto& device) {
    text.sample({{"device", name}}, std::uint64_t{device.kernel_dropped()});
  });
}

template <typename Value>
void write_each_output(const v1::Stats& stats, TextFormat& text, Value value) {
  for (const v1::OutputStats& output : stats.output()) {
    text.sample({{"output", output.name()}, {"kind", output.kind()}}, value(output));
  }
}

void write_clients(const Figures& figures, TextFormat& text) {
  text.gauge("posed_clients", "Connections of subscribers (publish) and controllers (control).");
  text.sample({{"socket", "publish"}}, std::uint64_t{figures.publish.peers});
  text.sample({{"socket", "control"}}, std::uint64_t{figures.control.peers});
  text.counter("posed_cut_clients_total",
               "Connections that posed ended because a limit was exceeded or a key withdrawn.");
  text.sample({{"socket", "publish"}}, figures.publish.cuts);
  text.sample({{"socket", "control"}}, figures.control.cuts);
  text.counter("posed_control_requests_total", "Requests to the control socket.");
  text.sample({}, figures.requests.requests);
  text.counter("posed_control_refusals_total", "Those of them that were refused.");
  text.sample({}, figures.requests.refusals);
  const v1::Stats& stats = figures.stats;
  text.gauge("posed_output_receivers", "Addresses or clients that an output sends to.");
  write_each_output(stats, text, [](const auto& out) { return std::uint64_t{out.receivers()}; });
  text.counter("posed_output_frames_total", "Frames handed to an output.");
  write_each_output(stats, text, [](const auto& out) { return std::uint64_t{out.frames()}; });
  text.counter("posed_output_sent_total", "Datagrams or lines that the system took.");
  write_each_output(stats, text, [](const auto& out) { return std::uint64_t{out.sent()}; });
  text.counter("posed_output_dropped_total", "Frames that an output did not send.");
  write_each_output(stats, text, [](const auto& out) { return std::uint64_t{out.dropped()}; });
  text.counter("posed_output_failures_total", "Sends that the system refused.");
  write_each_output(stats, text, [](const auto& out) { return std::uint64_t{out.failures()}; });
}

// A log and its journal, as far as the system tells them.
std::uint64_t bytes_of(const std::filesystem::path& file) {
  std::uint64_t sum = 0;
  for (const char* ending : {"", "-wal"}) {
    std::error_code failed;
    const auto bytes = std::filesystem::file_size(file.string() + ending, failed);
    if (!failed) sum += bytes;
  }
  return sum;
}

void write_recorder(const Figures& figures, TextFormat& text) {
  text.gauge("posed_recording", "Whether a device log is written.");
  text.sample({}, one_if(figures.recorder.has_value()));
  if (!figures.recorder) return;
  const RecorderFigures& recorder = *figures.recorder;
  text.gauge("posed_recorder_bytes", "Size of the device log.");
  text.sample({}, bytes_of(recorder.file));
  text.counter("posed_recorder_lost_total", "Records that are missing in the log.");
  text.sample({{"record", "chunk"}}, recorder.lost_chunks);
  text.sample({{"record", "frame"}}, recorder.lost_frames);
  text.counter("posed_recorder_errors_total", "Failed attempts to write the log.");
  text.sample({}, recorder.errors);
  text.gauge("posed_recorder_last_error_timestamp_seconds",
             "When the last of them was, in UTC since 1970; 0: there was none.");
  const bool none = recorder.error_ns == kNoTime_ns;
  text.sample({}, none ? 0.0 : seconds(recorder.error_ns + figures.stats.monotonic_to_utc_ns()));
  std::error_code failed;
  const auto space = std::filesystem::space(recorder.file.parent_path() / ".", failed);
  if (failed) return;
  text.gauge("posed_recorder_disk_free_bytes", "Free space where the log is.");
  text.sample({}, std::uint64_t{space.available});
  text.gauge("posed_recorder_disk_size_bytes", "Size of that file system.");
  text.sample({}, std::uint64_t{space.capacity});
}

void write_process(TextFormat& text) {
  text.gauge("posed_build_info", "Which version runs; always 1.");
  text.sample({{"version", POSED_VERSION}}, 1.0);
  text.counter("process_cpu_seconds_total", "Processor time of all threads.");
  text.sample({}, seconds(system::cpu_time_ns()));
  text.gauge("process_resident_memory_bytes", "Resident memory.");
  text.sample({}, system::resident_bytes());
  text.gauge("process_start_time_seconds", "When the process began, in UTC since 1970.");
  text.sample({}, system::start_time_s());
}

}  // namespace

std::string metrics_text(const Figures& figures) {
  TextFormat text;
  write_frames(figures, text);
  write_times(figures, text);
  write_streams(figures.stats, text);
  write_devices(figures.stats, text);
  write_clients(figures, text);
  write_recorder(figures, text);
  write_process(text);
  return text.finish();
}

}  // namespace posed::metrics
