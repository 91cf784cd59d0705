#include "launch/cli/program.h"

int main(int argc, char** argv) { return fivepipe::launch::run_program(argc, argv); }
