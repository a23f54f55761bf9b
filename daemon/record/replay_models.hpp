// ReplayModels: the models of one stream that a log's decisions name, bound before anything is
// replayed, so that nothing can fail on the way. Cold.
#pragma once

#include <array>
#include <map>
#include <memory>
#include <string>

#include "daemon/record/stream_settings.hpp"
#include "drivers/driver.hpp"
#include "models/generate/bound_model.hpp"
#include "models/style/style_filter.hpp"
#include "proto/frame/result.hpp"
#include "proto/log/reader.hpp"

namespace posed::record {

class ReplayModels {
 public:
  [[nodiscard]] Result<> load_style(const log::Reader& reader, const std::string& hash,
                                    const drivers::Description& description,
                                    const style::FilterOptions& options);
  [[nodiscard]] Result<> load_gesture(const log::Reader& reader, const std::string& hash,
                                      const drivers::Description& description);

  // Null when there is none of this hash. A style is another object than `current`: live, one that
  // replaces itself is, too.
  [[nodiscard]] const style::BoundModel* style(const std::string& hash,
                                               const style::BoundModel* current) const;
  [[nodiscard]] const generate::BoundModel* gesture(const std::string& hash) const;

 private:
  std::map<std::string, std::array<std::unique_ptr<const style::BoundModel>, 2>> styles_;
  std::map<std::string, std::unique_ptr<const generate::BoundModel>> gestures_;
};

}  // namespace posed::record
