// Control requests that are well formed but have invalid contents: models in pieces that overlap,
// come out of order or state absurd sizes, models with a right checksum and wrong numbers, plays,
// calibrations with lines of TOML exchanged. Several clients at once.
#include <array>
#include <cstdint>
#include <cstdlib>
#include <string>
#include <vector>

#include <fuzzer/FuzzedDataProvider.h>
#include <google/protobuf/stubs/logging.h>

#include "daemon/control/request_handler.hpp"
#include "drivers/glove/calibration_file.hpp"
#include "drivers/glove/traits.hpp"
#include "models/gesture/model_file.hpp"
#include "posed/v1/control.pb.h"
#include "proto/frame/hand_skeleton.hpp"
#include "proto/log/digest.hpp"
#include "tests/fuzz/check_command.hpp"
#include "tests/fuzz/demand.hpp"
#include "tests/fuzz/model_envelope.hpp"
#include "tests/support/stage_commands.hpp"
#include "tests/unit/models/gesture/toy_gesture.hpp"
#include "tests/unit/models/style/toy_style.hpp"

namespace {

using posed::fuzz::demand;
using namespace posed;

constexpr std::size_t kHeader = 24;  // bytes of a model file before its payload

// A body with a style, a hand with gestures, a glove.
std::vector<control::ControlledStream> three_streams() {
  std::vector<control::ControlledStream> streams(3);
  streams[0].name = "w";
  streams[0].skeleton = std::make_shared<const Skeleton>(test::toy_skeleton());
  streams[0].settings.stages.push_back(pipeline::stage_settings(style::style_type()));
  streams[0].models.resize(1);
  for (std::uint32_t i = 0; i < streams.size(); ++i) {
    streams[i].stream = streams[i].source_number = i;
  }
  streams[1].name = "h";
  streams[1].skeleton = std::make_shared<const Skeleton>(hand_skeleton(Side::kRight));
  streams[1].settings.rate_hz = 30.0;
  streams[1].settings.stages.push_back(pipeline::stage_settings(generate::generate_type()));
  streams[1].models.resize(1);
  streams[2].name = "g";
  streams[2].skeleton = streams[1].skeleton;
  const drivers::Driver* glove = drivers::find_driver("lucidgloves");
  const auto description = glove->expect({});
  demand(description.has_value());
  streams[2].device->connected(*description);
  return streams;
}

// Names every sensor of the glove.
std::string calibration_text() {
  const drivers::Driver* glove = drivers::find_driver("lucidgloves");
  const auto model = glove->glove->glove_model(glove->expect({}).value()).value();
  drivers::glove::CalibrationFile file;
  file.driver = model.driver;
  for (const auto& sensor : model.sensors) {
    file.sensors[sensor.name] = {{100.0, 0.0}, {3000.0, 1.0}};
  }
  return drivers::glove::format_calibration(file);
}

// A complete, valid model with some bytes exchanged and a recomputed checksum.
std::string broken_model(FuzzedDataProvider& data) {
  static const std::array<std::string, 2> kWhole{
      style::serialize_model(test::toy_model(1, 0.3)),
      gesture::serialize_model(test::toy_gesture_model())};
  std::string payload = data.PickValueInArray(kWhole).substr(kHeader);
  for (int i = data.ConsumeIntegralInRange(0, 4); i > 0; --i) {
    const auto at = data.ConsumeIntegralInRange<std::size_t>(0, payload.size() - 1);
    payload[at] = data.ConsumeIntegral<char>();
  }
  if (data.ConsumeIntegralInRange(0, 7) == 0) {
    payload.resize(data.ConsumeIntegralInRange<std::size_t>(0, payload.size()));
  }
  return fuzz::as_model_file(payload);
}

std::string broken_calibration(FuzzedDataProvider& data) {
  static const std::string kWhole = calibration_text();
  std::string text = kWhole;
  for (int i = data.ConsumeIntegralInRange(0, 4); i > 0; --i) {
    const auto at = data.ConsumeIntegralInRange<std::size_t>(0, text.size());
    const auto size = data.ConsumeIntegralInRange<std::size_t>(0, 20);
    text.replace(at, size, data.ConsumeRandomLengthString(20));
  }
  return text;
}

std::string stream_name(FuzzedDataProvider& data) {
  return data.PickValueInArray({"w", "h", "g", "absent", "nobody"});
}

struct Fixture {
  fuzz::CheckingControl daemon_control{3};
  devices::KeptSettings kept;
  control::RequestHandler handler{daemon_control, kept};

  Fixture() {
    for (control::ControlledStream& stream : three_streams()) {
      handler.add_stream(std::move(stream));
    }
    config::StreamConfig absent;
    absent.name = "absent";
    absent.stages.push_back(
        {.type = &style::style_type(),
         .parameters = complete_parameters(style::style_type().parameters, {}).value()});
    handler.add_known(control::known_stream(absent, "room"));
  }

  void ask(const std::string& client, const v1::ControlRequest& request) {
    const std::string bytes = request.SerializeAsString();
    check(handler.handle({client}, std::as_bytes(std::span(bytes))));
    for (const pipeline::Ack& ack : std::exchange(daemon_control.acks, {})) {
      const auto answer = handler.acknowledge(ack);
      demand(answer.has_value());
      check(answer);
    }
  }
  static void check(const std::optional<control::Reply>& answer) {
    if (!answer) return;
    v1::ControlReply reply;
    demand(reply.ParseFromString(answer->bytes));
    demand(reply.ok() || !reply.error().empty());
    demand(reply.error().find('\x1b') == std::string::npos);
  }
};

void send_model(FuzzedDataProvider& data, Fixture& fixture, const std::string& client) {
  const std::string model = broken_model(data);
  v1::ControlRequest request;
  auto& part = *request.mutable_model_part();
  part.set_stream(stream_name(data));
  part.set_name(data.ConsumeRandomLengthString(10));
  part.set_sha256(log::sha256_hex(std::as_bytes(std::span(model))));
  const std::size_t size =
      data.ConsumeIntegralInRange<std::size_t>(model.size() / 8 + 1, control::kMaxPiece);
  for (std::size_t offset = 0; offset < model.size(); offset += size) {
    const bool wrong = data.ConsumeIntegralInRange(0, 15) == 1;
    part.set_total(wrong ? data.ConsumeIntegral<std::uint64_t>() : model.size());
    part.set_offset(wrong && data.ConsumeBool() ? data.ConsumeIntegral<std::uint64_t>() : offset);
    part.set_bytes(model.substr(offset, size));
    fixture.ask(client, request);
  }
}

void send_other(FuzzedDataProvider& data, Fixture& fixture, const std::string& client) {
  v1::ControlRequest request;
  switch (data.ConsumeIntegralInRange(0, 3)) {
    case 0:
      request.mutable_calibrate()->set_stream(stream_name(data));
      request.mutable_calibrate()->set_toml(broken_calibration(data));
      request.mutable_calibrate()->set_name(data.ConsumeRandomLengthString(10));
      break;
    case 1:
      request.mutable_set_parameter()->set_stream(stream_name(data));
      request.mutable_set_parameter()->set_name(
          data.PickValueInArray({"alpha", "style.alpha", "style.gate", "calibrate", "lag_ms",
                                 "generate.labels", "style.weights", "mask", "."}));
      switch (data.ConsumeIntegralInRange(0, 2)) {
        case 0:
          request.mutable_set_parameter()->set_number(data.ConsumeFloatingPoint<double>());
          break;
        case 1:
          request.mutable_set_parameter()->set_flag(data.ConsumeBool());
          break;
        default:
          request.mutable_set_parameter()->set_text(
              data.PickValueInArray({"arms=", "legs=1,", "other=", ""}) +
              data.ConsumeRandomLengthString(40));
      }
      break;
    case 2:
      request.mutable_stage_command()->set_stream(stream_name(data));
      request.mutable_stage_command()->set_name(
          data.PickValueInArray({"play", "generate.play", "stop-playing", "style.play", "x"}));
      for (int i = data.ConsumeIntegralInRange(0, 300); i > 0; --i) {
        request.mutable_stage_command()->add_word(
            data.PickValueInArray({"a", "b", "rest", "\x1b"}));
      }
      (*request.mutable_stage_command()
            ->mutable_number())[data.PickValueInArray({"tempo", "loop", "\x1b"})] =
          data.ConsumeFloatingPoint<double>();
      break;
    default:
      request.mutable_haptics()->set_stream(stream_name(data));
      for (int i = data.ConsumeIntegralInRange(0, 7); i > 0; --i) {
        request.mutable_haptics()->add_force(data.ConsumeFloatingPoint<float>());
      }
      break;
  }
  fixture.ask(client, request);
}

}  // namespace

extern "C" int LLVMFuzzerInitialize(int* /*argc*/, char*** /*argv*/) {
  google::protobuf::SetLogHandler(
      nullptr);  // as in the daemon: no log line for each invalid string
  return 0;
}

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* bytes, std::size_t size) {
  static Fixture fixture;
  FuzzedDataProvider data(bytes, size);
  while (data.remaining_bytes() > 0) {
    const std::string client = data.PickValueInArray({"1", "2", "3", "4", "5"});
    if (data.ConsumeBool()) {
      send_model(data, fixture, client);
    } else {
      send_other(data, fixture, client);
    }
  }
  return 0;
}
