// GloveSource: the raw values of a glove's sensors for the command line, from a free device that it
// opens itself or through a running daemon.
#pragma once

#include <bitset>
#include <functional>
#include <memory>
#include <optional>
#include <span>
#include <string>

#include "daemon/cli/client.hpp"
#include "drivers/driver.hpp"
#include "drivers/transport/ports.hpp"

namespace posed::cli {

class GloveSource {
 public:
  using Raw = std::array<float, drivers::glove::kMaxSensors>;
  using Valid = std::bitset<drivers::glove::kMaxSensors>;
  // [sensor of the model]; what is not valid is not measured.
  using Take = std::function<void(const Raw& raw, const Valid& valid)>;

  // Speaks with the device and starts it.
  [[nodiscard]] static Result<std::unique_ptr<GloveSource>> open(const drivers::Driver& driver,
                                                                 const drivers::Options& options);
  // Of a stream that a daemon publishes. Without a driver it is known by its sensors' names.
  [[nodiscard]] static Result<std::unique_ptr<GloveSource>> connect(const ClientOptions& client,
                                                                    const std::string& stream,
                                                                    const drivers::Driver* driver,
                                                                    Side hand);
  virtual ~GloveSource() = default;
  GloveSource(const GloveSource&) = delete;
  GloveSource& operator=(const GloveSource&) = delete;

  [[nodiscard]] const drivers::glove::Model& model() const { return model_; }
  [[nodiscard]] const std::string& identity() const { return identity_; }

  // Hands over what comes for this long. An error when the glove is lost, nothing comes, or Ctrl-C.
  [[nodiscard]] virtual Result<> listen(double seconds, const Take& take) = 0;

 protected:
  GloveSource(drivers::glove::Model model, std::string identity)
      : model_(std::move(model)), identity_(std::move(identity)) {}

 private:
  drivers::glove::Model model_;
  std::string identity_;
};

}  // namespace posed::cli
