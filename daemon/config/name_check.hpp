// Checks that each name of a stream or source stands for one thing.
#pragma once

#include <string>
#include <vector>

#include "proto/text/toml_table.hpp"

namespace posed::config {

struct NamedTable {
  std::string name;
  int line = 0;
  bool is_source = false;
  bool publish_raw = false;  // of a stream, as <name>-raw
};

// Adds an error for each name that a table before has, and for each that is the name of a stream's
// raw input.
void check_names(std::vector<NamedTable> tables, Findings& findings);

}  // namespace posed::config
