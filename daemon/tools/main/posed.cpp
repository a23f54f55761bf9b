#include "daemon/tools/cli.hpp"

int main(int argc, char** argv) { return posed::tools::main_of(argc, argv); }
