#include "cli/verb.h"

int main(int argc, char** argv) { return anchorsplat::RunProgram(argc, argv); }
