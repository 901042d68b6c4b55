#include "formats/fuzz/readers.h"

#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <fstream>
#include <optional>
#include <utility>

#include "cameras/camera_io.h"
#include "cameras/colmap_model.h"
#include "core/gaussian_cloud.h"
#include "core/messages_for_test.h"
#include "core/random.h"
#include "core/text.h"
#include "formats/blocks_for_test.h"
#include "formats/extra_properties.h"
#include "formats/fuzz/seeds.h"
#include "formats/opened_splat.h"
#include "formats/registry.h"
#include "images/image_io.h"
#include "io/file_bytes_for_test.h"
#include "tensors/tensor_file.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

// Accepting bad input is a bug like a crash, and is reported as one.
void Require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "a reader accepted a file and gave %s\n", what);
  std::abort();
}

Status CheckError(const Error& error, std::string_view file) {
  Require(error.message.find(file) != std::string::npos, "an error that does not name the file");
  return error;
}

// Blocks must match the whole file.
void CompareBlocks(const SplatFormat& format, const InputFile& input, const Result<GaussianCloud>& read) {
  if (format.blocks == nullptr) return;
  const std::string difference = DifferenceOfBlocks(format.blocks, input, {}, read);
  Require(difference.empty(), Cat("in its blocks ", difference).c_str());
}

Status ReadAsCloud(const std::string& file, const std::string& bytes) {
  const InputFile input = InputFile::FromBytes(file, bytes);
  const auto head = input.Head(kSniffBytes);
  const SplatFormat* format = head.ok() ? FormatOfFile(*head, file) : nullptr;
  if (format != nullptr && format->describe != nullptr) {
    const auto facts = format->describe(input);
    if (!facts.ok()) (void)CheckError(facts.error(), file);
  }
  std::optional<CloudExtent> extent;
  if (format != nullptr && format->extent != nullptr) {
    const auto said = format->extent(input);
    if (said.ok()) {
      extent = *said;
    } else {
      (void)CheckError(said.error(), file);
    }
  }
  if (format == nullptr || format->read == nullptr) return Error{ErrorCode::kBadFile, "no format that is read"};
  const auto cloud = format->read(input, {});
  CompareBlocks(*format, input, cloud);
  if (!cloud.ok()) return CheckError(cloud.error(), file);
  Require(!cloud->empty(), "an empty cloud");
  Require(!extent || (extent->gaussians == cloud->size() && extent->sh_degree == cloud->sh_degree),
          "another number of Gaussians or degree than the header says");
  Require(Validate(*cloud).ok(), "a cloud whose arrays disagree");
  if (format->read_with_extras == nullptr) return {};
  ExtraProperties extras;
  const auto again = format->read_with_extras(input, {}, extras);
  if (!again.ok()) return CheckError(again.error(), file);
  Require(again->size() == cloud->size() && extras.fits(cloud->size()), "values beside other Gaussians");
  return {};
}

// Writes the file for a reader by path. Removed first: some file systems flush a file that is truncated and rewritten.
void Put(const fs::path& path, const std::string& bytes) {
  fs::remove(path);
  std::ofstream(path, std::ios::binary) << bytes;
}

Status ReadAsCameras(const fs::path& file, const fs::path& target, const std::string& bytes) {
  Put(file, bytes);
  const Messages unsaid;  // silences warnings about thousands of files
  const auto set = ReadCameras(target);
  if (!set.ok()) return CheckError(set.error(), target.filename().string());
  for (const Camera& camera : set->cameras) {
    Require(camera.intrinsics.width > 0 && camera.intrinsics.height > 0, "a camera without pixels");
  }
  return {};
}

Status ReadAsImage(const fs::path& file, const std::string& bytes) {
  Put(file, bytes);
  const auto image = ReadImage(file);
  if (!image.ok()) return CheckError(image.error(), file.filename().string());
  const auto size = ReadImageSize(file);
  Require(size.ok() && size->orientation >= 1 && size->orientation <= 8, "a picture without a size");
  Require(image->width > 0 && image->height > 0 && (image->channels == 3 || image->channels == 4), "no picture");
  Require(static_cast<int64_t>(image->pixels.size()) == image->plane() * image->channels, "an image of another size");
  return {};
}

// Splat formats: a reader for each format in the registry, with seeds from its own writer, if any, and handmade ones.
void AddSplatFormats(const fs::path& folder, std::vector<FuzzReader>& readers) {
  for (const SplatFormat& format : Formats()) {
    // The latter two have several files.
    if (format.read == nullptr || format.name == "glTF as JSON" || format.name == "streamed SOG") continue;
    const std::string file = "fuzz" + std::string(format.extensions.front());
    FuzzReader reader{
        std::string(format.name), {}, {}, [file](const std::string& bytes) { return ReadAsCloud(file, bytes); }};
    if (format.write != nullptr) {
      for (int degree = 0; degree <= kMaxShDegree; ++degree) {
        (void)format.write(folder / file, SeedCloud(5, degree), {.overwrite = true});
        reader.seeds.push_back(FileBytes(folder / file));
      }
    }
    if (format.name == "PLY") {
      for (std::string& seed : PlySeeds()) reader.seeds.push_back(std::move(seed));
      reader.words = PlyWords();
    }
    if (format.name == "gsplat checkpoint") {
      reader.seeds = GsplatSeeds();
      reader.words = TorchWords();
    }
    if (format.name == "ksplat") reader.seeds = KsplatSeeds();
    if (format.name == "SOG" || format.name == "glTF") reader.words = JsonWords();
    if (!reader.seeds.empty()) readers.push_back(std::move(reader));
  }
}

// Up to version 3, SPZ is one gzip stream, whose checksum rejects nearly all damage: damage its contents and compress
// again.
void AddSpzContent(const fs::path& folder, std::vector<FuzzReader>& readers) {
  FuzzReader reader{
      "SPZ in gzip", {}, {}, [](const std::string& bytes) { return ReadAsCloud("fuzz.spz", Gzip(bytes)); }};
  for (int degree = 0; degree <= kMaxShDegree; ++degree) reader.seeds.push_back(SpzContentSeed(folder, degree));
  readers.push_back(std::move(reader));
}

// Compressed and archived splats.
void AddPackedSplats(const fs::path& folder, std::vector<FuzzReader>& readers) {
  readers.push_back({"packed splat", PackedSeeds(folder), {}, [](const std::string& bytes) -> Status {
                       const auto opened = OpenedSplat::Of(InputFile::FromBytes("fuzz.ply.gz", bytes));
                       if (!opened.ok()) return CheckError(opened.error(), "fuzz.ply.gz");
                       const auto cloud = opened->Read();
                       if (opened->format() != nullptr) CompareBlocks(*opened->format(), opened->input(), cloud);
                       if (!cloud.ok()) return CheckError(cloud.error(), "fuzz.ply.gz");
                       Require(Validate(*cloud).ok(), "a cloud whose arrays disagree");
                       return {};
                     }});
}

// Splats of several files, one of which is damaged: SOG folders (members of a ZIP archive have checksums), and the JSON
// of a glTF with a separate buffer.
void AddSplatsOfSeveralFiles(const fs::path& folder, std::vector<FuzzReader>& readers) {
  struct Part {
    const char *format, *main, *damaged;
  };
  constexpr Part kParts[] = {
      {"SOG folder", "meta.json", "meta.json"},          {"SOG folder", "meta.json", "means_u.webp"},
      {"SOG folder", "meta.json", "shN_centroids.webp"}, {"streamed SOG", "lod-meta.json", "lod-meta.json"},
      {"glTF as JSON", "fuzz.gltf", "fuzz.gltf"},        {"glTF as JSON", "fuzz.gltf", "fuzz.bin"}};
  for (const Part& part : kParts) {
    const fs::path own = folder / Cat("of_", part.damaged);
    fs::create_directories(own);
    (void)WriteCloud(own / part.main, SeedCloud(5, 1), {.overwrite = true});
    FuzzReader reader{Cat(part.format, ", ", part.damaged),
                      {FileBytes(own / part.damaged)},
                      {},
                      [own, part](const std::string& bytes) -> Status {
                        Put(own / part.damaged, bytes);
                        const auto opened = OpenedSplat::Open(own / part.main);
                        if (!opened.ok()) return CheckError(opened.error(), own.filename().string());
                        const auto cloud = opened->Read();
                        if (opened->format() != nullptr) CompareBlocks(*opened->format(), opened->input(), cloud);
                        if (!cloud.ok()) return CheckError(cloud.error(), own.filename().string());
                        Require(Validate(*cloud).ok(), "a cloud whose arrays disagree");
                        return {};
                      }};
    if (std::string_view(part.damaged) == part.main) reader.words = JsonWords();
    readers.push_back(std::move(reader));
  }
}

Status ReadAsTensors(const std::string& file, const std::string& bytes) {
  Buffer<std::byte> copy(bytes.size());
  if (!bytes.empty()) std::memcpy(copy.data(), bytes.data(), bytes.size());
  const auto tensors = TensorFile::FromBytes(std::move(copy), file);
  if (!tensors.ok()) return CheckError(tensors.error(), file);
  for (const TensorEntry& entry : tensors->tensors()) {
    // Strides may repeat one element many times; callers that copy know the expected shape.
    if (entry.bytes() > (int64_t{16} << 20)) continue;
    const auto values = CopyContiguous(entry);
    Require(!values.ok() || static_cast<int64_t>(values->size()) == entry.bytes(), "a tensor of another size");
    Require(CopyFloat32(entry).ok() || CopyInt64(entry).ok() || entry.type == TensorType::kUint64,
            "a tensor without numbers");
  }
  return {};
}

void AddTensorFormats(const fs::path& folder, std::vector<FuzzReader>& readers) {
  readers.push_back({"PyTorch checkpoint", TorchSeeds(), TorchWords(),
                     [](const std::string& bytes) { return ReadAsTensors("fuzz.pth", bytes); }});
  readers.push_back({"safetensors", SafetensorsSeeds(folder), JsonWords(),
                     [](const std::string& bytes) { return ReadAsTensors("fuzz.safetensors", bytes); }});
}

void AddCameraFormats(const fs::path& folder, std::vector<FuzzReader>& readers) {
  const auto add = [&](const char* file, std::vector<std::string> seeds, std::vector<std::string_view> words) {
    readers.push_back({file, std::move(seeds), std::move(words),
                       [path = folder / file](const std::string& bytes) { return ReadAsCameras(path, path, bytes); }});
  };
  add("transforms.json", TransformsSeeds(), JsonWords());
  add("cameras.json", InriaCamerasSeeds(), JsonWords());
  add("poses_bounds.npy", {PosesBoundsSeed()}, {"'<f4'", "True", "(2, 17)"});
  add("metashape.xml", MetashapeSeeds(), XmlWords());
  add("reconstruction.json", OpenSfmSeeds(), JsonWords());
  // Bundler's image sizes come from images, and nerfstudio's frame belongs to cameras beside it.
  fs::create_directories(folder / "bundler");
  fs::create_directories(folder / "nerfstudio");
  (void)WritePng(folder / "bundler" / "a.png", Image(40, 30, 3));
  Put(folder / "bundler" / "list.txt", "a.png\na.png 0 50\n");
  Put(folder / "nerfstudio" / "transforms.json", TransformsSeeds().front());
  add("bundler/bundle.out", {BundlerSeed()}, {"nan", "1e308", "-", "0"});
  add("nerfstudio/dataparser_transforms.json", {NerfstudioFrameSeed()}, JsonWords());
  // A COLMAP model has two files: one is damaged, the other stays intact.
  const auto add_colmap = [&](const char* kind, const char* damaged, const ColmapSeeds& good, bool cameras) {
    const fs::path model = folder / Cat("colmap_", kind, "_", cameras ? "cameras" : "images");
    fs::create_directories(model);
    Put(model / Cat("cameras.", kind), good.cameras);
    Put(model / Cat("images.", kind), good.images);
    readers.push_back({Cat("colmap ", damaged),
                       {cameras ? good.cameras : good.images},
                       {"PINHOLE", "OPENCV", "#"},
                       [path = model / damaged](const std::string& bytes) {
                         Put(path, bytes);
                         const auto set = ReadCameras(path.parent_path());
                         return set.ok() ? Status() : CheckError(set.error(), path.parent_path().filename().string());
                       }});
  };
  add_colmap("bin", "cameras.bin", ColmapBinarySeeds(), true);
  add_colmap("bin", "images.bin", ColmapBinarySeeds(), false);
  add_colmap("txt", "cameras.txt", ColmapTextSeeds(), true);
  add_colmap("txt", "images.txt", ColmapTextSeeds(), false);

  const auto add_points = [&](const char* kind, const std::string& good) {
    const fs::path model = folder / Cat("colmap_", kind, "_points");
    fs::create_directories(model);
    readers.push_back({Cat("colmap points3D.", kind), {good}, {}, [model, kind](const std::string& bytes) {
                         Put(model / Cat("points3D.", kind), bytes);
                         const auto points = ReadColmapPoints(model);
                         return points.ok() ? Status() : CheckError(points.error(), "points3D");
                       }});
  };
  add_points("bin", ColmapBinarySeeds().points);
  add_points("txt", ColmapTextSeeds().points);
}

void AddImageFormats(const fs::path& folder, std::vector<FuzzReader>& readers) {
  readers.push_back({"png", PngSeeds(folder), {}, [path = folder / "fuzz.png"](const std::string& bytes) {
                       return ReadAsImage(path, bytes);
                     }});
  readers.push_back({"jpeg", JpegSeeds(), {}, [path = folder / "fuzz.jpg"](const std::string& bytes) {
                       return ReadAsImage(path, bytes);
                     }});
  readers.push_back({"webp", WebpSeeds(), {}, [path = folder / "fuzz.webp"](const std::string& bytes) {
                       return ReadAsImage(path, bytes);
                     }});
  readers.push_back({"tiff", TiffSeeds(), {}, [path = folder / "fuzz.tif"](const std::string& bytes) {
                       return ReadAsImage(path, bytes);
                     }});
}

}  // namespace

std::vector<FuzzReader> FuzzReaders(const fs::path& folder) {
  std::vector<FuzzReader> readers;
  AddSplatFormats(folder, readers);
  AddSpzContent(folder, readers);
  AddPackedSplats(folder, readers);
  AddSplatsOfSeveralFiles(folder, readers);
  AddTensorFormats(folder, readers);
  AddCameraFormats(folder, readers);
  AddImageFormats(folder, readers);
  return readers;
}

}  // namespace anchorsplat
