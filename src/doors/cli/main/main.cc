#include "cli/main/quiet_driver.h"
#include "cli/verb.h"

int main(int argc, char** argv) {
  anchorsplat::QuietDriver();
  return anchorsplat::RunProgram(argc, argv);
}
