// `posed eval natural`: whether people move as a clip does, measured beside a corpus of clips.
#pragma once

namespace CLI {
class App;
}

namespace posed::tools {

void add_eval_natural(CLI::App& eval, int& exit_code);

}  // namespace posed::tools
