// A device log with valid tables, types and checksums and arbitrary contents: it is refused with an
// error message or replayed to its end; nothing crashes, hangs or takes unbounded memory. The input
// chooses the streams, their settings and models, and then each row; now and then also the schema,
// and then the log must be refused.
#include <cstdint>
#include <cstdlib>
#include <filesystem>
#include <string>
#include <vector>

#include <fuzzer/FuzzedDataProvider.h>
#include <sqlite3.h>
#include <unistd.h>

#include "daemon/pipeline/description_row.hpp"
#include "daemon/pipeline/messages.hpp"
#include "daemon/tools/replay/expectation.hpp"
#include "daemon/tools/replay/replay.hpp"
#include "drivers/template_mocap/protocol.hpp"
#include "models/gesture/model_file.hpp"
#include "models/style/model/style_model.hpp"
#include "posed/v1/log.pb.h"
#include "proto/log/reader.hpp"
#include "proto/log/schema.hpp"
#include "proto/log/writer.hpp"
#include "proto/message/frame_message.hpp"
#include "tests/support/file_text.hpp"
#include "tests/unit/models/gesture/toy_gesture.hpp"
#include "tests/unit/models/style/toy_style.hpp"

namespace {

using namespace posed;
using test::bytes_of;

constexpr const char* kBody =
    "HIERARCHY\nROOT Hips\n{\nOFFSET 0 90 0\nCHANNELS 6 Xposition Yposition Zposition Zrotation "
    "Yrotation Xrotation\nJOINT Chest\n{\nOFFSET 0 30 0\nCHANNELS 3 Zrotation Yrotation Xrotation\n"
    "End Site\n{\nOFFSET 0 20 0\n}\n}\n}\nMOTION\nFrames: 1\nFrame Time: 0.016667\n"
    "0 90 0 0 0 0 0 0 0\n";

// A log written from the fuzzer's input.
class FuzzedLog {
 public:
  FuzzedLog(const std::uint8_t* data, std::size_t size, const std::filesystem::path& path)
      : input_(data, size), path_(path), writer_(log::Writer::create(path, {}).value()) {}

  bool write() {
    static const std::string style = style::serialize_model(test::toy_model(1));
    static const std::string gated = style::serialize_model(test::gated_toy_model(1));
    static const std::string two = style::serialize_model(test::toy_styles({1, 2}));
    static const std::string gesture = gesture::serialize_model(test::toy_gesture_model());
    hashes_ = {writer_.add_blob(bytes_of(style)).value(),
               writer_.add_blob(bytes_of(gated)).value(),
               writer_.add_blob(bytes_of(two)).value(),
               writer_.add_blob(bytes_of(gesture)).value(),
               writer_.add_blob(bytes_of("no model")).value(),
               "feed",
               ""};
    const auto streams = input_.ConsumeIntegralInRange<std::uint32_t>(1, 3);
    for (std::uint32_t i = 0; i < streams; ++i) add_stream(i);
    for (int rows = 0; rows < 200 && input_.remaining_bytes() > 0; ++rows) add_row();
    return writer_.close().has_value();
  }

  // Makes the log bring something to run along, or a table that is not posed's. Returns whether it
  // does.
  bool twist_schema() {
    if (input_.ConsumeProbability<double>() < 0.8) return false;
    const std::string table = input_.PickValueInArray<std::string>(
        {"meta", "source", "stream", "blob", "chunk", "decision", "frame", "gap", "take"});
    const std::string endless =
        "WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i+1 FROM n) SELECT ";
    const std::string text = input_.ConsumeRandomLengthString(100);
    const std::string expression = input_.PickValueInArray<std::string>(
        {"hex(zeroblob(60000000))", "(SELECT max(i) FROM n)", "randomblob(100000000)", "1", text});
    switch (input_.ConsumeIntegralInRange(0, 6)) {
      case 0:
        return change("DROP TABLE " + table + "; CREATE VIEW " + table + " AS " + endless +
                      expression + " FROM n");
      case 1:
        return change("CREATE TRIGGER t AFTER INSERT ON " + table + " BEGIN SELECT " + expression +
                      "; END");
      case 2:
        return change("CREATE INDEX i ON " + table + "(" + expression + ")");
      case 3:
        return change("ALTER TABLE " + table + " ADD COLUMN c TEXT AS (" + expression + ")");
      case 4:
        return change("DROP TABLE " + table + "; CREATE TABLE " + table +
                      "(id INTEGER PRIMARY KEY, crc CHECK(" + expression + "))");
      case 5:
        return change("CREATE VIRTUAL TABLE v USING fts5(a)");
      default:  // what no statement of SQLite would write
        return change("PRAGMA writable_schema=1; UPDATE sqlite_master SET " +
                      input_.PickValueInArray<std::string>({"sql", "name", "tbl_name", "type"}) +
                      "=CAST(x'" + hex(text) + "' AS TEXT) WHERE name='" + table + "'");
    }
  }

 private:
  static std::string hex(const std::string& text) {
    std::string digits;
    for (const unsigned char c : text) {
      digits += "0123456789abcdef"[c / 16];
      digits += "0123456789abcdef"[c % 16];
    }
    return digits;
  }

  [[nodiscard]] bool change(const std::string& sql) const {
    sqlite3* handle = nullptr;
    bool changed = sqlite3_open(path_.c_str(), &handle) == SQLITE_OK;
    sqlite3_limit(handle, SQLITE_LIMIT_LENGTH, 1'000'000);
    changed = changed && sqlite3_exec(handle, sql.c_str(), nullptr, nullptr, nullptr) == SQLITE_OK;
    sqlite3_close(handle);
    return changed;
  }

  void add_stream(std::uint32_t i) {
    const std::uint32_t id = input_.ConsumeBool() ? i : (1U << 16U | i);
    std::string driver =
        input_.PickValueInArray<std::string>({"file", "lucidgloves", "labels", "template_mocap"});
    // now and then another stream of the source before it
    const bool again = driver == "template_mocap" && i > 0 && input_.ConsumeBool();
    const std::string body = driver == "template_mocap" ? "b" + std::to_string(i) : "";
    std::string text = driver == "file" ? kBody : "";
    if (const auto* row = drivers::find_driver(driver); row->expect != nullptr) {
      text = row->expect({}).value().text;
    }
    if (input_.ConsumeProbability<double>() < 0.1) driver = input_.ConsumeRandomLengthString(16);
    if (input_.ConsumeProbability<double>() < 0.2) text = input_.ConsumeRandomLengthString(400);
    ids_.push_back(id);
    const std::uint32_t source = again ? ids_.front() : id;
    keep(writer_.add(log::SourceRow{id, "s", driver, text, "x", "{}"}));
    keep(writer_.add(log::StreamRow{id, source, body, "s" + std::to_string(i), settings(), 1}));
  }

  std::string number() {
    switch (input_.ConsumeIntegralInRange(0, 3)) {
      case 0:
        return std::to_string(input_.ConsumeIntegral<std::int8_t>());
      case 1:
        return std::to_string(input_.ConsumeFloatingPointInRange(-1e7, 1e7));
      default:
        return input_.PickValueInArray<std::string>({"0", "1", "0.5", "30", "1e6", "1e300", "-1"});
    }
  }

  std::string settings() {
    if (input_.ConsumeProbability<double>() < 0.1) return input_.ConsumeRandomLengthString(200);
    std::string stages;
    const auto add = [&](const std::string& stage) {
      stages += (stages.empty() ? "" : ",") + stage;
    };
    if (input_.ConsumeBool()) {
      add(R"({"stage":"style","model":")" + hash() + R"(","parameters":{"alpha":)" + number() +
          R"(,"alpha_slew_per_s":)" + number() + R"(,"gate":true,"gate_fallback":)" + number() +
          "}}");
    }
    if (input_.ConsumeBool()) {
      add(R"({"stage":"generate","model":")" + hash() + R"(","parameters":{"lag_frames":)" +
          number() + R"(,"lag_s":)" + number() + R"(,"noise_rad":)" + number() + "}}");
    }
    if (input_.ConsumeBool()) add(R"({"stage":"constrain","parameters":{}})");
    return R"({"publish_raw":true,"stale_after_s":)" + number() + R"(,"rate_hz":)" + number() +
           R"(,"stages":[)" + stages + "]}";
  }

  std::string hash() { return input_.PickValueInArray(hashes_); }
  std::uint32_t id() {
    if (input_.ConsumeProbability<double>() < 0.02) return input_.ConsumeIntegral<std::uint32_t>();
    return ids_[input_.ConsumeIntegralInRange<std::size_t>(0, ids_.size() - 1)];
  }
  // Mostly the count that a real run would write, sometimes an arbitrary one.
  std::uint64_t count(std::uint64_t next) {
    if (input_.ConsumeProbability<double>() < 0.05) return input_.ConsumeIntegral<std::uint64_t>();
    return next + input_.ConsumeIntegralInRange<std::uint64_t>(0, 3);
  }
  std::int64_t time_ns() {
    if (input_.ConsumeProbability<double>() < 0.03) return input_.ConsumeIntegral<std::int64_t>();
    now_ns_ += input_.ConsumeIntegralInRange<std::int64_t>(-1'000'000, 700'000'000);
    return now_ns_;
  }

  void add_row() {
    switch (input_.ConsumeIntegralInRange(0, 9)) {
      case 0:
      case 1:
      case 2:
        return add_decision();
      case 3:
        return keep(writer_.add(
            log::GapRow{static_cast<log::GapRow::Kind>(input_.ConsumeIntegralInRange(0, 3)), id(),
                        input_.ConsumeIntegral<std::int8_t>(), count(1), time_ns()}));
      case 4:
        return keep(
            writer_.add(log::FrameRow{id(), count(1), input_.ConsumeBool(),
                                      bytes_of(bytes_ = input_.ConsumeRandomLengthString(50))}));
      default:
        return add_chunk();
    }
  }

  // A row that says which streams the bodies of a source are.
  std::string description() {
    std::vector<std::uint32_t> streams;
    std::vector<drivers::mocap::BodyEntry> bodies;
    for (int n = input_.ConsumeIntegralInRange(0, 3); n > 0; --n) {
      streams.push_back(input_.ConsumeProbability<double>() < 0.1 ? pipeline::kNoStream : id());
      bodies.push_back({.id = input_.ConsumeIntegralInRange<std::uint16_t>(1, 4),
                        .name = std::string(1, static_cast<char>('a' + n)),
                        .joints = {{"hips", -1, {}}}});
      if (input_.ConsumeBool()) bodies.back().joints.push_back({"head", 0, {0.0F, 0.5F, 0.0F}});
    }
    const auto datagram = drivers::mocap::encode_description(bodies);
    const auto content = std::span(datagram).subspan(8, datagram.size() - 12);
    const auto row = pipeline::pack_description(streams, content);
    places_.clear();
    for (const std::uint32_t stream : streams) {
      if (stream != pipeline::kNoStream) places_.push_back({stream, count(frames_), 1});
    }
    return {reinterpret_cast<const char*>(row.data()), row.size()};
  }

  // A frame of up to three of those bodies.
  std::string mocap_frame() {
    drivers::mocap::FramePacket frame{
        .number = static_cast<std::uint32_t>(frames_), .time_us = 0, .bodies = {}};
    for (int n = input_.ConsumeIntegralInRange(0, 3); n > 0; --n) {
      auto& pose = frame.bodies.emplace_back();
      pose.id = input_.ConsumeIntegralInRange<std::uint16_t>(1, 4);
      pose.rotation_xyzw.assign(input_.ConsumeIntegralInRange<std::size_t>(0, 3), kIdentity);
    }
    const auto datagram = drivers::mocap::encode_frame(frame);
    return {reinterpret_cast<const char*>(datagram.data()), datagram.size()};
  }

  void add_chunk() {
    const std::uint32_t source = id();
    std::vector<log::StreamPosition> places{{source, count(frames_), count(frames_)}};
    frames_ += 1;
    items_ += 2;
    bytes_ = input_.PickValueInArray<std::string>(
        {"0 90 0 1 2 3 4 5 6\n", "0 90 0 9 9 9 9 9 9\n",
         "A100B200C300D400E500F600G700H800(AAB)1000(ABB)900\n", "A4095B0C4095D0E4095\n", "x"});
    if (input_.ConsumeBool()) bytes_ = input_.ConsumeRandomLengthString(300);
    const auto direction = input_.ConsumeProbability<double>() < 0.8
                               ? std::uint8_t{0}
                               : input_.ConsumeIntegralInRange<std::uint8_t>(0, 5);
    if (direction == 4 && input_.ConsumeProbability<double>() < 0.95) {
      bytes_ = description();
      places = places_;
    } else if (!places_.empty() && input_.ConsumeBool()) {
      bytes_ = mocap_frame();
      places = places_;
    }
    keep(writer_.add(log::ChunkRow{.source = source,
                                   .direction = direction,
                                   .arrival_ns = time_ns(),
                                   .first_item = count(items_),
                                   .places = places,
                                   .bytes = bytes_of(bytes_)}));
  }

  void add_decision() {
    v1::DecisionValue value;
    log::DecisionRow row;
    row.item = count(items_);
    row.stream = id();
    row.now_ns = time_ns();
    const auto say = [&](const char* stage, const char* name) {
      row.stage = stage;
      row.name = name;
    };
    switch (input_.ConsumeIntegralInRange(0, 12)) {
      case 0:
        say("style", "alpha");
        value.set_number(input_.ConsumeFloatingPointInRange(-2.1, 2.1));
        break;
      case 1:
        say("style", "model");
        value.set_sha256(hash());
        break;
      case 2:
        say("generate", "model");
        value.set_sha256(hash());
        break;
      case 3:
        say("generate", "play");
        for (int n = input_.ConsumeIntegralInRange(0, 6); n > 0; --n) {
          value.mutable_play()->add_label(input_.ConsumeIntegralInRange<std::uint32_t>(0, 7));
        }
        value.mutable_play()->set_tempo(input_.ConsumeFloatingPointInRange(0.4F, 2.1F));
        value.mutable_play()->set_loop(input_.ConsumeBool());
        break;
      case 4:
        say("generate", "stop-playing");
        break;
      case 5:
        say("", input_.ConsumeBool() ? "shed" : "shed-samples");
        value.mutable_range()->set_first(count(frames_));
        value.mutable_range()->set_count(count(1));
        break;
      case 6:
      case 7:
        say("", "tick");
        break;
      case 8:
        say("", "end");
        break;
      case 9:
        say("style", input_.ConsumeBool() ? "weights" : "mask");
        for (int n = input_.ConsumeIntegralInRange(0, 7); n > 0; --n) {
          value.mutable_weights()->add_weight(input_.ConsumeIntegralInRange(-1, 4) / 3.0);
        }
        break;
      case 10:
        say("style", "warm-up");
        value.set_number(input_.ConsumeFloatingPointInRange(0.0, 100.0));
        break;
      case 11:
        say("style", "know-walker");
        for (int n = input_.ConsumeIntegralInRange(0, 8); n > 0; --n) {
          value.mutable_walker()->add_dimension(
              input_.ConsumeIntegralInRange<std::uint32_t>(0, 30));
          value.mutable_walker()->add_angle(input_.ConsumeIntegral<std::int16_t>());
        }
        if (input_.ConsumeBool()) {
          value.mutable_walker()->set_cadence_rad_s(input_.ConsumeFloatingPoint<float>());
        }
        break;
      default:
        row.stage = input_.ConsumeRandomLengthString(8);
        row.name = input_.ConsumeRandomLengthString(8);
    }
    row.value = value.SerializeAsString();
    if (input_.ConsumeProbability<double>() < 0.05) {
      row.value = input_.ConsumeRandomLengthString(40);
    }
    keep(writer_.add(row));
  }

  // The writer refuses, for example, a second stream with the same id.
  static void keep(const Result<>& done) { static_cast<void>(done); }

  FuzzedDataProvider input_;
  std::filesystem::path path_;
  log::Writer writer_;
  std::array<std::string, 7> hashes_;
  std::vector<std::uint32_t> ids_;
  std::string bytes_;                        // of the current row
  std::vector<log::StreamPosition> places_;  // of the latest description
  std::uint64_t frames_ = 1, items_ = 1;
  std::int64_t now_ns_ = 1'000'000'000;
};

void replay_log(const std::filesystem::path& path) {
  auto reader = log::Reader::open(path);
  if (!reader) return;
  auto opened = replay::Replay::open(*reader);
  if (!opened) {
    if (opened.error().message.empty()) std::abort();
    return;
  }
  replay::Replay& replay = **opened;
  auto expectation = replay::Expectation::open(*reader);
  message::FrameEncoder encoder("s");
  const auto out = [&](const pipeline::Item& item) {
    using Kind = pipeline::Item::Kind;
    if (item.kind != Kind::kFrame && item.kind != Kind::kRawFrame) return;
    const std::uint32_t stream = item.frame.header.stream;
    if (stream >= replay.streams()) std::abort();
    const v1::Frame& frame = encoder.encode(item.frame);
    if (!expectation) return;
    const auto same =
        expectation->compare(stream, item.kind == Kind::kRawFrame, frame, replay.broken_at(stream));
    static_cast<void>(same);
  };
  const auto done = replay.run(out, [](const log::ChunkRow&) { return true; });
  if (!done && done.error().message.empty()) std::abort();
}

}  // namespace

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  // On an in-memory file system where there is one, because a log is always a file.
  static const std::filesystem::path folder =
      std::filesystem::exists("/dev/shm") ? "/dev/shm" : std::filesystem::temp_directory_path();
  static const std::filesystem::path path =
      folder / ("posed_fuzz_log_" + std::to_string(getpid()) + ".plog");
  FuzzedLog log(data, size, path);
  if (log.write()) {
    const bool is_twisted = log.twist_schema();
    if (is_twisted && posed::log::Reader::open(path)) std::abort();
    replay_log(path);
  }
  std::error_code ignored;
  for (const char* suffix : posed::log::kFileSuffixes) {
    std::filesystem::remove(path.string() + suffix, ignored);
  }
  return 0;
}
