// Repeated changes of models and alpha in a running daemon: every frame arrives, nothing leaks
// (with ASan the daemon's exit code shows it), and no joint ever jumps. POSED_SWAP_SECONDS=60 is
// the long run: 1,000 changes.
#include <cstdlib>
#include <map>
#include <random>

#include "posed/v1/control.pb.h"
#include "proto/log/digest.hpp"
#include "proto/zmq/zmq_handle.hpp"
#include "tests/e2e/served.hpp"

namespace posed::test {
namespace {

using net::Message;
using std::chrono::milliseconds;
using std::chrono::steady_clock;

constexpr double kSlew_per_s = 2.0;  // FilterOptions' default
constexpr double kRate_hz = 120.0;
constexpr milliseconds kChangeEvery{60};

// A style that adds the same change to every pose, so that every other movement is caused by posed.
style::StyleModel constant_style(unsigned seed) {
  style::StyleModel model = toy_model(seed, 0.3);
  model.process.weights.setZero();
  return model;
}

// The largest rotation vector that the style adds to one joint at alpha 1.
double reach_rad(const style::StyleModel& model) {
  double reach = 0.0;
  for (int j = 0; j < model.process.offset.size() / 3; ++j) {
    reach = std::max(reach, model.process.offset.segment<3>(3 * j).norm());
  }
  return reach;
}

using Rotations = std::vector<Eigen::Quaterniond>;

Rotations rotations_of(const v1::Frame& frame) {
  Rotations rotations;
  for (int i = 0; i + 3 < frame.rotation_xyzw_size(); i += 4) {
    rotations.emplace_back(frame.rotation_xyzw(i + 3), frame.rotation_xyzw(i),
                           frame.rotation_xyzw(i + 1), frame.rotation_xyzw(i + 2));
  }
  return rotations;
}

// The frames of both published streams, by sequence number.
struct Seen {
  std::map<std::uint64_t, Rotations> raw, styled;

  void take(void* subscriber) {
    Message topic, body;
    if (!topic.receive(subscriber) || !body.receive(subscriber, 0)) return;
    v1::Frame frame;
    const auto bytes = body.bytes();
    REQUIRE(frame.ParseFromArray(bytes.data(), static_cast<int>(bytes.size())));
    auto& stream = topic.text() == "pose/walker" ? styled : raw;
    CHECK(stream.emplace(frame.sequence(), rotations_of(frame)).second);
  }

  // The number of missing frames between the first and the last.
  [[nodiscard]] std::uint64_t gaps() const {
    return styled.rbegin()->first - styled.begin()->first + 1 - styled.size();
  }

  // The largest change, from one frame to the next, of the rotation that the style adds [rad].
  [[nodiscard]] double largest_step_rad() const {
    double largest = 0.0;
    const Rotations* before = nullptr;
    Rotations last;
    std::uint64_t last_sequence = 0;
    for (const auto& [sequence, out] : styled) {
      const auto in = raw.find(sequence);
      if (in == raw.end()) continue;
      Rotations added;
      for (std::size_t j = 0; j < out.size(); ++j) {
        added.push_back(in->second[j].conjugate() * out[j]);
        if (before != nullptr && last_sequence + 1 == sequence) {
          largest = std::max(largest, last[j].angularDistance(added[j]));
        }
      }
      last = std::move(added);
      before = &last;
      last_sequence = sequence;
    }
    return largest;
  }
};

v1::ControlRequest random_change(std::mt19937& random, const std::array<std::string, 2>& models) {
  v1::ControlRequest request;
  if (random() % 2 == 0) {
    const std::string& model = models[random() % 2];
    auto& part = *request.mutable_model_part();
    part.set_stream("walker");
    part.set_sha256(log::sha256_hex(std::as_bytes(std::span(model))));
    part.set_total(model.size());
    part.set_bytes(model);  // small enough for one piece
    return request;
  }
  request.mutable_set_parameter()->set_stream("walker");
  request.mutable_set_parameter()->set_name("alpha");
  request.mutable_set_parameter()->set_number(
      std::uniform_real_distribution<double>(-2, 2)(random));
  return request;
}

TEST_CASE("a thousand changes: no frame lost, no jump") {
  const char* wanted = std::getenv("POSED_SWAP_SECONDS");
  const auto run_for = std::chrono::seconds(wanted == nullptr ? 3 : std::atoi(wanted));
  const std::array<style::StyleModel, 2> styles{constant_style(1), constant_style(2)};
  const std::array<std::string, 2> models{style::serialize_model(styles[0]),
                                          style::serialize_model(styles[1])};
  Served served;
  served.folder.write("one.style", models[0]);
  served.start();
  const auto context = *net::open_context();
  const auto subscriber = *net::open_socket(context.get(), ZMQ_SUB);
  REQUIRE(net::set_option(subscriber.get(), ZMQ_RCVHWM, 0));
  REQUIRE(net::set_option(subscriber.get(), ZMQ_SUBSCRIBE, "pose/walker"));
  REQUIRE(net::connect_socket(subscriber.get(), served.publish));
  const auto dealer = *net::open_socket(context.get(), ZMQ_DEALER);
  REQUIRE(net::connect_socket(dealer.get(), served.control));

  std::mt19937 random(7);
  Seen seen;
  int asked = 0, answered = 0;
  const auto start = steady_clock::now();
  while (steady_clock::now() < start + run_for || answered < asked) {
    if (steady_clock::now() < start + run_for &&
        steady_clock::now() >= start + asked * kChangeEvery) {
      const auto bytes = random_change(random, models).SerializeAsString();
      REQUIRE(net::send_part(dealer.get(), bytes, false));
      ++asked;
    }
    REQUIRE(steady_clock::now() < start + run_for + std::chrono::seconds(60));
    std::array<zmq_pollitem_t, 2> wait{
        {{subscriber.get(), 0, ZMQ_POLLIN, 0}, {dealer.get(), 0, ZMQ_POLLIN, 0}}};
    if (zmq_poll(wait.data(), 2, 5) <= 0) continue;
    if ((wait[0].revents & ZMQ_POLLIN) != 0) seen.take(subscriber.get());
    Message message;
    if ((wait[1].revents & ZMQ_POLLIN) != 0 && message.receive(dealer.get())) {
      v1::ControlReply reply;
      REQUIRE(reply.ParseFromArray(message.bytes().data(), int(message.bytes().size())));
      INFO(reply.error());
      CHECK(reply.ok());
      ++answered;
    }
  }
  v1::ControlRequest request;
  request.mutable_status();
  REQUIRE(net::send_part(dealer.get(), request.SerializeAsString(), false));
  zmq_pollitem_t wait{dealer.get(), 0, ZMQ_POLLIN, 0};
  REQUIRE(zmq_poll(&wait, 1, 30'000) == 1);
  Message message;
  REQUIRE(message.receive(dealer.get()));
  v1::ControlReply reply;
  REQUIRE(reply.ParseFromArray(message.bytes().data(), int(message.bytes().size())));
  served.daemon->send(SIGTERM);
  CHECK(served.daemon->exit_code() == 0);
  INFO(served.daemon->errors());

  REQUIRE(seen.styled.size() > 20);
  // Frames that an overloaded machine sheds are counted; no others may be missing.
  CHECK(seen.gaps() <= reply.status().stream(0).shed() + reply.status().stream(0).dropped());
  // Per frame alpha moves by slew dt, and a blend (between model deltas of at most 2 reach each) by
  // the same share of its length; the walk itself turns the same change by at most half of its own
  // step.
  const double reach = std::max(reach_rad(styles[0]), reach_rad(styles[1]));
  const double walk_step_rad = 0.3 * std::sqrt(3.0) * 2.0 * kPi / kRate_hz;
  const double allowed_rad = 5.0 * reach * kSlew_per_s / kRate_hz + reach * walk_step_rad;
  const double largest_rad = seen.largest_step_rad();
  WARN(answered << " changes, " << seen.styled.size() << " frames, " << seen.gaps()
                << " missing, largest step " << largest_rad << " rad of " << allowed_rad
                << " allowed");
  CHECK(largest_rad <= allowed_rad);
  CHECK(largest_rad > 0.1 * allowed_rad);  // the changes did take effect
}

}  // namespace
}  // namespace posed::test
