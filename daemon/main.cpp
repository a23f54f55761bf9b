#include "daemon/cli/cli.hpp"

int main(int argc, char** argv) { return posed::cli::main_of(argc, argv); }
