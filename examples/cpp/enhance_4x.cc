// Makes a splat hold up when it is seen four times closer, and draws it before and after.
#include <anchorsplat/anchorsplat.h>

#include <cstdlib>
#include <iostream>

using namespace anchorsplat;

template <typename T>
T OrExit(Expected<T> result) {
  if (!result.ok()) {
    std::cerr << "error: " << result.failure().message << '\n';
    std::exit(1);
  }
  if constexpr (!std::is_void_v<T>) return *std::move(result);
}

int main(int argc, char** argv) {
  if (argc != 4) return std::cerr << "enhance_4x INPUT OUTPUT PICTURE.png\n", 2;
  const RunSettings run{.message = [](MessageLevel, const std::string& sentence) { std::cerr << sentence << '\n'; }};
  const Splat before = OrExit(ReadSplat(argv[1], run));
  const EnhanceOutcome after = OrExit(Enhance(before, {.upscale = 4}, run));
  const PinholeCamera camera = OrExit(OrbitAround(before, 1, 1024, 1024)).front();
  const Picture was = OrExit(Render(before, camera)).color, is = OrExit(Render(after.splat, camera)).color;
  const CaptionedPicture columns[] = {{"before", &was}, {"after", &is}};
  OrExit(WritePicture(argv[3], OrExit(ComparisonSheet(columns)), /*overwrite=*/true));
  OrExit(WriteSplat(argv[2], after.splat, {.overwrite = true}, run));
  std::cout << after.gaussians_in << " Gaussians, " << after.gaussians_out << " by " << after.method << '\n';
}
