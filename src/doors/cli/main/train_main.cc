// The program with the training in it, and LibTorch. `anchorsplat train` runs it.
#include <unistd.h>

#include <cstdlib>

#include "cli/main/quiet_driver.h"
#include "cli/verb.h"
#include "train/trainer.h"

int main(int argc, char** argv) {
  // LibTorch's threads spin at the end of every loop until the others are there, which on a busy machine takes a time
  // slice. OpenMP reads how to wait before main begins, so the program starts itself again.
  if (std::getenv("OMP_WAIT_POLICY") == nullptr) {
    setenv("OMP_WAIT_POLICY", "passive", /*overwrite=*/0);
    execv("/proc/self/exe", argv);
  }
  anchorsplat::QuietDriver();
  return anchorsplat::RunProgram(argc, argv, {anchorsplat::Train});
}
