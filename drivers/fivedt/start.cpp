#include "drivers/fivedt/start.hpp"

#include <algorithm>
#include <chrono>

#include "drivers/glove/device_info.hpp"

namespace posed::drivers::fivedt {
namespace {

using Bytes = std::vector<std::byte>;
using Clock = std::chrono::steady_clock;
using std::chrono::milliseconds;

constexpr milliseconds kPatience{2000};  // as in VRPN
constexpr milliseconds kOneRead{50};
constexpr milliseconds kQuiet{30};
constexpr int kPackets = 2;  // a wireless type gives its hand after the first packet

// Appends received bytes to `bytes` until `enough` of it; returns false on a timeout.
template <typename Enough>
Result<bool> collect(Connection& link, Bytes& bytes, const Enough& enough) {
  const auto begin = Clock::now();
  while (!enough()) {
    if (Clock::now() - begin > kPatience) return false;
    const auto more = link.read(kOneRead);
    if (!more) return std::unexpected(more.error());
    bytes.insert(bytes.end(), more->begin(), more->end());
  }
  return true;
}

std::unexpected<Error> other_hand(const Connection& link, Side found) {
  const std::string name(glove::side_name(found));
  return fail("this is a " + name + " glove; set hand = \"" + name + "\" or take the other one",
              link.name());
}

// Starts a Data Glove 5 with a two-way cable: asks for its info, then starts the stream.
Result<> start_wired(Connection& link, Side side, bool polled) {
  if (auto ok = link.drain(kQuiet); !ok) return ok;
  if (auto ok = link.write("A"); !ok) return ok;
  Bytes answer;
  const auto ready =
      collect(link, answer, [&] { return std::ranges::find(answer, kReady) != answer.end(); });
  if (!ready) return std::unexpected(ready.error());
  if (!*ready) {
    return fail(
        "the glove does not answer; check that it is switched on and a Data Glove 5 at "
        "19200 baud, or choose model = \"5-wireless\" for one that only sends",
        link.name());
  }
  answer.clear();
  if (auto ok = link.write("G"); !ok) return ok;
  constexpr std::array kMark{std::byte{'B'}, std::byte{'R'}};
  const auto info = [&] { return std::ranges::search(answer, kMark).begin(); };
  const auto whole = collect(link, answer, [&] {
    return answer.end() - info() >= static_cast<std::ptrdiff_t>(kInfoBytes);
  });
  if (!whole) return std::unexpected(whole.error());
  if (!*whole) return fail("what answers is no 5DT Data Glove 5; check the port", link.name());
  const bool right = (info()[4] & std::byte{1}) != std::byte{0};
  if (right != (side == Side::kRight)) {
    return other_hand(link, right ? Side::kRight : Side::kLeft);
  }
  return polled ? Result<>() : link.write("D");
}

// What a streaming glove has sent so far.
class Heard final : public Readings {
 public:
  void reading(const Reading& reading) noexcept override {
    if (reading.kind == Reading::Kind::kData) {
      ++packets;
    } else {
      info = true;
      right = reading.right;
    }
  }
  void outcome(Outcome /*outcome*/) noexcept override {}

  int packets = 0;
  bool info = false, right = false;
};

Result<std::vector<std::string>> await_stream(Connection& link, Side side,
                                              const Settings& settings) {
  Framer framer(settings.form);
  Heard heard;
  Bytes bytes;
  std::size_t fed = 0;
  const auto good = collect(link, bytes, [&] {
    framer.feed(std::span(bytes).subspan(fed), heard);
    fed = bytes.size();
    return heard.packets >= kPackets;
  });
  if (!good) return std::unexpected(good.error());
  if (!*good) {
    return fail(bytes.empty()
                    ? "the glove sends nothing; check that it is switched on, its model and baud"
                    : "what comes is not of this model of 5DT glove; check model, baud and port",
                link.name());
  }
  const Side other = side == Side::kRight ? Side::kLeft : Side::kRight;
  if (heard.info && heard.right != (side == Side::kRight)) return other_hand(link, other);
  std::vector<std::string> warnings;
  const int capability = framer.capability();
  if (capability >= 0 && says_left(static_cast<std::byte>(capability)) != (side == Side::kLeft)) {
    const std::string name(glove::side_name(other));
    warnings.push_back("the glove seems to be a " + name + " one; if so, set hand = \"" + name +
                       "\"");
  }
  return warnings;
}

}  // namespace

Result<std::vector<std::string>> start(Connection& link, Side side, const Settings& settings) {
  if (settings.form != Form::kFive) return await_stream(link, side, settings);
  const auto ok = start_wired(link, side, settings.polled);
  if (!ok) return std::unexpected(ok.error());
  return std::vector<std::string>();
}

}  // namespace posed::drivers::fivedt
