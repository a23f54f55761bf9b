#include "tests/lab/daemon_check.hpp"

#include <algorithm>
#include <chrono>
#include <cstdio>
#include <fstream>
#include <functional>
#include <thread>
#include <vector>

#include <nlohmann/json.hpp>

#include "drivers/driver.hpp"
#include "tests/lab/gadget.hpp"
#include "tests/lab/listener.hpp"
#include "tests/lab/resources.hpp"
#include "tests/support/process.hpp"

namespace posed::lab {
namespace {

using namespace std::chrono_literals;
using Clock = std::chrono::steady_clock;
using Bytes = std::vector<std::byte>;

constexpr int kRounds = 10;
constexpr std::uint64_t kSamplesARound = 60;
constexpr auto kPeriod = 20ms;  // between a glove's reports
constexpr auto kPatience = 15s;
constexpr auto kMaxReturn = 1s;
constexpr const char* kConfig = "/tmp/lab.toml";

// A glove whose report n has n % modulus in every sensor.
struct Glove {
  std::string device;  // of lab_devices()
  std::string driver;
  std::string config;  // what its [[stream]] says beside name and driver
  std::uint32_t modulus = 1;
  std::function<Bytes(std::uint32_t value)> report;
};

Bytes ultra_usb(std::uint32_t value) {
  Bytes report(64);
  for (std::size_t i = 0; i < 14; ++i) {
    report[2 * i] = static_cast<std::byte>(value >> 8);
    report[2 * i + 1] = static_cast<std::byte>(value);
  }
  return report;
}

Bytes alpha_line(std::uint32_t value) {
  const std::string n = std::to_string(value);
  const std::string text = "A" + n + "B" + n + "C" + n + "D" + n + "E" + n + "\n";
  const auto bytes = std::as_bytes(std::span(text));
  return {bytes.begin(), bytes.end()};
}

// Report 1, five bends of six bits, no button, no LED in sight.
Bytes p5_report(std::uint32_t value) {
  Bytes report(24);
  report[0] = std::byte{1};
  for (std::size_t finger = 0; finger < 5; ++finger) {
    for (std::size_t bit = 0; bit < 6; ++bit) {
      const std::size_t at = 8 + 6 * finger + bit;
      if ((value >> (5 - bit) & 1) != 0) report[at / 8] |= std::byte{0x80} >> (at % 8);
    }
  }
  report[5] |= std::byte{0x0F};
  report[6] |= std::byte{0xFF};
  report[7] |= std::byte{0xF0};
  return report;
}

std::vector<Glove> gloves() {
  return {{.device = "hidraw",
           .driver = "fivedt",
           .config = "id = \"HID-1\"\n[stream.fivedt]\nmodel = \"ultra-usb-14\"\n",
           .modulus = 4000,
           .report = ultra_usb},
          {.device = "libusb", .driver = "p5", .config = "", .modulus = 64, .report = p5_report},
          {.device = "ttyacm",
           .driver = "lucidgloves",
           .config = "id = \"ACM-1\"\n",
           .modulus = 4096,
           .report = alpha_line}};
}

// A glove that speaks all the time, plugged in or not.
class Speaker {
 public:
  Speaker(LabDevice& device, const Glove& glove)
      : device_(device),
        glove_(glove),
        thread_([this](const std::stop_token& stop) { speak(stop); }) {}

  [[nodiscard]] LabDevice& device() const { return device_; }
  [[nodiscard]] const std::string& name() const { return glove_.device; }

 private:
  void speak(const std::stop_token& stop) {
    for (std::uint32_t n = 1; !stop.stop_requested(); std::this_thread::sleep_for(kPeriod)) {
      if (device_.say(glove_.report(n % glove_.modulus))) ++n;
    }
  }

  LabDevice& device_;
  const Glove& glove_;
  std::jthread thread_;
};

bool wait_until(const std::function<bool()>& what) {
  const auto deadline = Clock::now() + kPatience;
  while (!what()) {
    if (Clock::now() > deadline) return false;
    std::this_thread::sleep_for(5ms);
  }
  return true;
}

struct Replugs {
  Clock::duration back{}, since_plug{};  // from the kernel's finding it; from the plug
  std::string trouble;
};

// From the moment the kernel has found it to the first frame that a client has.
Replugs replug(Speaker& glove, Listener& listener) {
  Replugs sum;
  LabDevice& device = glove.device();
  for (int round = 0; round < kRounds && sum.trouble.empty(); ++round) {
    device.unplug();
    std::this_thread::sleep_for(200ms);  // what was on its way has come
    listener.new_session(glove.name());
    const std::uint64_t before = listener.heard(glove.name()).samples;
    const auto plugged_at = Clock::now();
    device.plug();
    if (!wait_until(device.is_there)) sum.trouble = "the kernel does not find it again";
    const auto there_at = Clock::now();
    if (!wait_until([&] { return listener.heard(glove.name()).samples > before; })) {
      sum.trouble = "no frame came after a replug";
    }
    sum.back = std::max(sum.back, Clock::now() - there_at);
    sum.since_plug = std::max(sum.since_plug, Clock::now() - plugged_at);
    (void)wait_until(
        [&] { return listener.heard(glove.name()).samples > before + kSamplesARound; });
  }
  return sum;
}

std::string start_daemon(std::optional<test::Process>& daemon, const std::vector<Glove>& present) {
  std::ofstream config(kConfig);
  config << "realtime = false\n[publish]\nendpoint = \"tcp://127.0.0.1:*\"\n"
            "[control]\nendpoint = \"tcp://127.0.0.1:*\"\n";
  for (const Glove& glove : present) {
    config << "[[stream]]\nname = \"" << glove.device << "\"\ndriver = \"" << glove.driver << "\"\n"
           << glove.config;
  }
  config.close();
  daemon.emplace(std::vector<std::string>{"run", "--config", kConfig});
  const auto line = daemon->line();
  if (!line) give_up("posed does not start: " + daemon->errors());
  return nlohmann::json::parse(*line).at("publish");
}

long ms(Clock::duration time) {
  return static_cast<long>(std::chrono::duration_cast<std::chrono::milliseconds>(time).count());
}

void tell(const Speaker& glove, const Replugs& replugs, const Heard& heard, bool good) {
  std::printf("%s posed %s: %d replugs, %llu samples, %llu mixed, %llu reports skipped",
              good ? "ok  " : "FAIL", glove.name().c_str(), kRounds,
              static_cast<unsigned long long>(heard.samples),
              static_cast<unsigned long long>(heard.mixed),
              static_cast<unsigned long long>(heard.skipped));
  std::printf(", %llu gaps, back %ld ms after the kernel found it, %ld ms after the plug%s%s\n",
              static_cast<unsigned long long>(heard.gaps), ms(replugs.back), ms(replugs.since_plug),
              replugs.trouble.empty() ? "" : ": ", replugs.trouble.c_str());
}

bool check_resources(const Resources& before, const Resources& after) {
  const bool good = after.descriptors == before.descriptors &&
                    after.memory_kb <= before.memory_kb + kMemorySlack_kb;
  std::printf("%s posed after all replugs: descriptors %ld -> %ld, memory %ld -> %ld KB\n",
              good ? "ok  " : "FAIL", before.descriptors, after.descriptors, before.memory_kb,
              after.memory_kb);
  return good;
}

}  // namespace

int check_daemon(const LabDevices& devices) {
  std::vector<Glove> present;
  for (Glove& glove : gloves()) {
    if (drivers::find_driver(glove.driver) != nullptr) present.push_back(std::move(glove));
  }
  std::vector<std::unique_ptr<Speaker>> speakers;
  std::map<std::string, std::uint32_t> modulus;
  for (const Glove& glove : present) {
    auto& device = **std::ranges::find(devices, glove.device, &LabDevice::name);
    device.plug();
    speakers.push_back(std::make_unique<Speaker>(device, glove));
    modulus[glove.device] = glove.modulus;
  }
  std::optional<test::Process> daemon;
  Listener listener(start_daemon(daemon, present), modulus);
  const auto all_stream = [&] {
    return std::ranges::all_of(speakers, [&](const auto& glove) {
      return listener.heard(glove->name()).samples > kSamplesARound;
    });
  };
  if (!wait_until(all_stream)) std::printf("posed says: %s\n", daemon->errors().c_str());
  const Resources before = Resources::of(std::to_string(daemon->pid()));
  int failed = 0;
  std::map<std::string, Replugs> replugs;
  for (const auto& glove : speakers) replugs[glove->name()] = replug(*glove, listener);
  const Resources after = Resources::of(std::to_string(daemon->pid()));
  for (const auto& glove : speakers) {
    const Heard heard = listener.heard(glove->name());
    const Replugs& own = replugs[glove->name()];
    const bool good = own.trouble.empty() && own.back < kMaxReturn && heard.mixed == 0 &&
                      heard.skipped == 0 && heard.gaps == 0 &&
                      heard.samples > kRounds * kSamplesARound;
    tell(*glove, own, heard, good);
    failed += good ? 0 : 1;
  }
  failed += check_resources(before, after) ? 0 : 1;
  if (failed != 0) std::printf("posed says: %s\n", daemon->errors().c_str());
  for (const auto& glove : speakers) glove->device().unplug();
  return failed;
}

}  // namespace posed::lab
