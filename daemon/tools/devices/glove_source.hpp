// GloveSource: raw sensor values of a glove for the command line, either from a free device, which
// it opens itself, or through a running daemon.
#pragma once

#include <bitset>
#include <functional>
#include <memory>
#include <string>

#include "daemon/tools/command/client.hpp"
#include "drivers/driver.hpp"
#include "drivers/glove/model.hpp"
#include "drivers/transport/transport_factory.hpp"
#include "proto/frame/hand.hpp"

namespace posed::tools {

class GloveSource {
 public:
  using Raw = std::array<float, drivers::glove::kMaxSensors>;
  using Valid = std::bitset<drivers::glove::kMaxSensors>;
  // [sensor of the model]; values that are not valid were not measured.
  using Accept = std::function<void(const Raw& raw, const Valid& valid)>;

  // Opens the device and starts it.
  static Result<std::unique_ptr<GloveSource>> open(const drivers::Driver& driver,
                                                   const drivers::Options& options);
  // For a stream of a running daemon; the daemon reports which glove it is.
  static Result<std::unique_ptr<GloveSource>> connect(const ClientOptions& client,
                                                      const std::string& stream);
  virtual ~GloveSource() = default;
  GloveSource(const GloveSource&) = delete;
  GloveSource& operator=(const GloveSource&) = delete;

  [[nodiscard]] const drivers::glove::Model& model() const { return glove_.model; }
  [[nodiscard]] const std::string& identity() const { return glove_.identity; }
  [[nodiscard]] Side hand() const { return glove_.hand; }

  // Passes on what comes for this long, or until `enough` returns true, which is asked after each
  // measurement and ten times a second. Returns an error if the glove is lost, nothing comes, or on
  // Ctrl-C.
  virtual Result<> listen(double seconds, const Accept& accept,
                          const std::function<bool()>& enough) = 0;
  Result<> listen(double seconds, const Accept& accept) {
    return listen(seconds, accept, [] { return false; });
  }

 protected:
  struct Glove {
    drivers::glove::Model model;
    std::string identity;
    Side hand = Side::kRight;
  };
  static Result<Glove> known(const drivers::Driver& driver,
                             const drivers::Description& description);
  explicit GloveSource(Glove glove) : glove_(std::move(glove)) {}

 private:
  Glove glove_;
};

}  // namespace posed::tools
