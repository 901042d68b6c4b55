#include "formats/fuzz/seeds.h"

#include <zlib.h>
#include <zstd.h>

#include <array>
#include <cstdio>
#include <cstdlib>
#include <cstring>
#include <initializer_list>

// Behind <cstdio>: it needs FILE.
#include <jpeglib.h>

#include "core/image.h"
#include "core/random.h"
#include "core/source_dir_for_test.h"
#include "core/text.h"
#include "formats/fuzz/binary.h"
#include "formats/spz/spz_writer.h"
#include "images/image_io.h"
#include "images/webp_image.h"
#include "io/atomic_file.h"
#include "io/file_bytes_for_test.h"
#include "io/zip_archive.h"
#include "tensors/safetensors.h"
#include "tensors/tensor_entry.h"

namespace anchorsplat {

namespace {

constexpr std::string_view kGaussianNames[] = {"rot_0",   "rot_1",   "rot_2",   "rot_3",  "x",
                                               "y",       "z",       "f_dc_0",  "f_dc_1", "f_dc_2",
                                               "opacity", "scale_0", "scale_1", "scale_2"};

// Two rows of alternating doubles and floats after a list, between elements with and without lists.
std::string PlyHeaderText(std::string_view encoding) {
  std::string header =
      Cat("ply\nformat ", encoding, " 1.0\ncomment SplatRenderMode: mip\nobj_info seed\n",
          "element camera 1\nproperty int id\nproperty uchar kind\n",
          "element strip 2\nproperty list uchar int indices\n", "element vertex 2\nproperty list ushort short tags\n");
  bool wide = false;
  for (const std::string_view name : kGaussianNames) {
    header += Cat("property ", (wide = !wide) ? "double " : "float ", name, "\n");
  }
  return header + "property uchar label\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n";
}

std::string BinaryPly(bool big_endian) {
  Binary out(big_endian);
  out.Text(PlyHeaderText(big_endian ? "binary_big_endian" : "binary_little_endian"));
  out.Put(int32_t{1});
  out.Put(uint8_t{2});
  for (uint8_t n : {uint8_t{0}, uint8_t{3}}) {
    out.Put(n);
    for (int32_t k = 0; k < n; ++k) out.Put(k);
  }
  for (int row = 0; row < 2; ++row) {
    out.Put(static_cast<uint16_t>(row));
    for (int k = 0; k < row; ++k) out.Put(int16_t{-1});
    bool wide = false;
    for (size_t k = 0; k < std::size(kGaussianNames); ++k) {
      const double value = 0.25 * static_cast<double>(k) - row;
      if ((wide = !wide)) {
        out.Put(value);
      } else {
        out.Put(static_cast<float>(value));
      }
    }
    out.Put(uint8_t{9});
  }
  out.Put(uint8_t{3});
  for (int32_t k = 0; k < 3; ++k) out.Put(k);
  return out.bytes();
}

std::string AsciiPly(const char* line_end) {
  std::string text = PlyHeaderText("ascii") + "1 2\n0\n3 0 1 2\n";
  text += "0 1 0 0 0 0.5 -0.5 1e-3 1 2 3 -2.5 -4 -4 -5.25 9\n";
  text += "1 -1 0.5 .5 0 0 nan -0.5 1e+3 1 2 3 +2.5 -inf -4 -5.25 0\n3 0 1 0\n";
  std::string out;
  for (const char c : text) out += c == '\n' ? line_end : std::string(1, c);
  return out;
}

std::string Jpeg(bool progressive) {
  jpeg_compress_struct info{};
  jpeg_error_mgr errors{};
  info.err = jpeg_std_error(&errors);
  jpeg_create_compress(&info);
  unsigned char* memory = nullptr;
  unsigned long size = 0;  // NOLINT(google-runtime-int): libjpeg's type
  jpeg_mem_dest(&info, &memory, &size);
  info.image_width = 19;
  info.image_height = 17;
  info.input_components = 3;
  info.in_color_space = JCS_RGB;
  jpeg_set_defaults(&info);
  if (progressive) jpeg_simple_progression(&info);
  jpeg_start_compress(&info, TRUE);
  std::vector<JSAMPLE> row(3 * info.image_width);
  for (JDIMENSION y = 0; y < info.image_height; ++y) {
    for (size_t k = 0; k < row.size(); ++k) row[k] = static_cast<JSAMPLE>(4 * k + 7 * y);
    JSAMPROW rows = row.data();
    jpeg_write_scanlines(&info, &rows, 1);
  }
  jpeg_finish_compress(&info);
  jpeg_destroy_compress(&info);
  std::string bytes(reinterpret_cast<const char*>(memory), size);
  std::free(memory);
  return bytes;
}

std::vector<std::string> TestFiles(std::initializer_list<const char*> names) {
  std::vector<std::string> files;
  for (const char* name : names) {
    files.push_back(FileBytes(SourceDirForTest() / "testdata/tensors" / name));
  }
  return files;
}

}  // namespace

GaussianCloud SeedCloud(int64_t count, int sh_degree) {
  GaussianCloud cloud;
  cloud.Resize(count, sh_degree);
  Random random(static_cast<uint64_t>(sh_degree));
  for (Buffer<float>* array : {&cloud.means, &cloud.log_scales, &cloud.quats, &cloud.opacity_logits, &cloud.sh}) {
    for (float& x : *array) x = static_cast<float>(random.Normal());
  }
  cloud.render_mode = RenderMode::kAntialiased;
  cloud.comments = {"a seed"};
  // An extension record of an SPZ.
  if (sh_degree == 1)
    cloud.comments.push_back("SPZ extension SPZ_ADOBE_safe_orbit_camera (0xADBE0002): 000102030405060708090a0b");
  return cloud;
}

std::vector<std::string> PlySeeds() {
  std::string filtered = AsciiPly("\n");
  constexpr std::string_view kLabel = "uchar label";
  filtered.replace(filtered.find(kLabel), kLabel.size(), "float filter_3D");
  return {BinaryPly(false), BinaryPly(true), AsciiPly("\n"), AsciiPly("\r\n"), AsciiPly("\r"), filtered};
}

std::vector<std::string_view> PlyWords() {
  return {"ply",
          "format",
          "ascii",
          "binary_little_endian",
          "binary_big_endian",
          "1.0",
          "element",
          "vertex",
          "face",
          "chunk",
          "property",
          "list",
          "char",
          "uchar",
          "short",
          "ushort",
          "int",
          "uint",
          "float",
          "double",
          "x",
          "opacity",
          "scale_0",
          "rot_3",
          "f_dc_0",
          "f_rest_0",
          "f_rest_8",
          "f_rest_44",
          "comment",
          "obj_info",
          "end_header",
          "element vertex 1000000000\n",
          "property list uchar int q\n",
          "\r\n"};
}

std::vector<std::string> KsplatSeeds() {
  std::vector<std::string> seeds;
  for (uint16_t level = 0; level < 3; ++level) {
    std::string header(4096 + 1024, '\0');
    const auto put = [&header](size_t at, auto value) { std::memcpy(header.data() + at, &value, sizeof value); };
    put(1, uint8_t{1});
    put(4, uint32_t{1});
    put(16, uint32_t{3});
    put(20, level);
    put(4096, uint32_t{3});
    put(4096 + 4, uint32_t{3});
    put(4096 + 40, uint16_t{1});
    std::string buckets;
    if (level > 0) {
      put(4096 + 8, uint32_t{2});
      put(4096 + 12, uint32_t{2});
      put(4096 + 16, 5.0f);
      put(4096 + 20, uint16_t{12});
      put(4096 + 32, uint32_t{1});
      put(4096 + 36, uint32_t{1});
      buckets.assign(4 + 2 * 12, '\0');
      buckets[0] = 1;
    }
    const size_t record = level == 0 ? 44 + 36 : level == 1 ? 24 + 18 : 24 + 9;
    seeds.push_back(header + buckets + std::string(3 * record, '\x35'));
  }
  return seeds;
}

std::string SpzContentSeed(const std::filesystem::path& folder, int sh_degree) {
  (void)WriteSpz(folder / "seed.spz", SeedCloud(5, sh_degree), {.overwrite = true, .spz_version = 3});
  const std::string packed = FileBytes(folder / "seed.spz");
  std::string content(4096, '\0');  // 5 Gaussians need less
  z_stream stream{};
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(packed.data()));
  stream.avail_in = static_cast<uInt>(packed.size());
  stream.next_out = reinterpret_cast<Bytef*>(content.data());
  stream.avail_out = static_cast<uInt>(content.size());
  (void)inflateInit2(&stream, 31);  // 31: with the gzip header
  (void)inflate(&stream, Z_FINISH);
  content.resize(stream.total_out);
  inflateEnd(&stream);
  return content;
}

std::string Gzip(const std::string& content) {
  z_stream stream{};
  (void)deflateInit2(&stream, Z_BEST_SPEED, Z_DEFLATED, 31, 8, Z_DEFAULT_STRATEGY);
  std::string packed(deflateBound(&stream, static_cast<uLong>(content.size())), '\0');
  stream.next_in = reinterpret_cast<Bytef*>(const_cast<char*>(content.data()));
  stream.avail_in = static_cast<uInt>(content.size());
  stream.next_out = reinterpret_cast<Bytef*>(packed.data());
  stream.avail_out = static_cast<uInt>(packed.size());
  (void)deflate(&stream, Z_FINISH);
  packed.resize(stream.total_out);
  deflateEnd(&stream);
  return packed;
}

std::vector<std::string> PackedSeeds(const std::filesystem::path& folder) {
  const std::string content = PlySeeds().front();
  std::string zstd(ZSTD_compressBound(content.size()), '\0');
  zstd.resize(ZSTD_compress(zstd.data(), zstd.size(), content.data(), content.size(), 1));
  const std::filesystem::path archive = folder / "seed.zip";
  if (auto file = OutputFile::Create(archive, true); file.ok()) {
    ZipWriter zip(*file);
    (void)zip.Add("scan.ply", content);
    (void)zip.Finish();
    (void)file->Commit();
  }
  const size_t half = content.size() / 2;
  return {Gzip(content), Gzip(content.substr(0, half)) + Gzip(content.substr(half)), zstd, FileBytes(archive)};
}

std::vector<std::string> TorchSeeds() {
  return TestFiles({"ckpt_degree1.pt", "legacy.pth", "parameters.pth", "protocol4.pth", "state_dict.pth", "types.pth",
                    "views.pth", "wrapped.pth"});
}

std::vector<std::string> GsplatSeeds() { return TestFiles({"ckpt_degree0.pt", "ckpt_degree1.pt", "ckpt_degree3.pt"}); }

std::vector<std::string_view> TorchWords() {
  return {"torch",
          "_utils",
          "_rebuild_tensor_v2",
          "FloatStorage",
          "storage",
          "OrderedDict",
          "collections",
          "archive",
          "data.pkl",
          "PK",
          "os",
          "system",
          "ctorch\nDoubleStorage\n",
          "ccollections\nOrderedDict\n)R",
          "cnumpy\ndtype\n)R",
          "(",
          "Q",
          "R",
          "b",
          "e",
          "t",
          "u",
          "]",
          "}",
          "\x8a\x08\xff\xff\xff\xff\xff\xff\xff\x7f",
          "\x8a\x01\xff"};
}

std::vector<std::string> SafetensorsSeeds(const std::filesystem::path& folder) {
  const std::vector<float> values = {0, 1, 2, 3, 4, 5};
  const std::vector<int64_t> integers = {7, -8};
  const std::vector<TensorEntry> tensors = {MakeEntry("weights", {2, 3}, values), MakeEntry("steps", {2}, integers),
                                            MakeEntry("nothing", {0, 4}, std::span<const float>())};
  (void)WriteSafetensors(folder / "seed.safetensors", tensors, {{"format", "pt"}}, {.overwrite = true});
  return {FileBytes(folder / "seed.safetensors")};
}

std::vector<std::string> PngSeeds(const std::filesystem::path& folder) {
  std::vector<std::string> seeds;
  for (const int channels : {1, 3, 4}) {
    Image image(7, 5, channels);
    for (size_t k = 0; k < image.pixels.size(); ++k) image.pixels[k] = static_cast<float>(k % 11) / 10;
    (void)WritePng(folder / "seed.png", image, {.overwrite = true});
    seeds.push_back(FileBytes(folder / "seed.png"));
  }
  return seeds;
}

std::vector<std::string> JpegSeeds() { return {Jpeg(false), Jpeg(true)}; }

std::vector<std::string> WebpSeeds() {
  std::vector<std::string> seeds;
  for (const uint8_t alpha : {255, 100}) {
    ByteImage image{7, 5, {}};
    for (int i = 0; i < 4 * 35; ++i) image.rgba.push_back(i % 4 == 3 ? alpha : static_cast<uint8_t>(11 * i));
    seeds.push_back(*EncodeWebp(std::move(image)));
  }
  return seeds;
}

// Little-endian, not compressed, rgb: in strips of two rows, and in tiles of 16 x 16.
std::vector<std::string> TiffSeeds() {
  std::vector<std::string> seeds;
  for (const bool tiled : {false, true}) {
    constexpr uint32_t kWidth = 7, kHeight = 4, kRows = 2, kSide = 16;
    const std::string pixels(3 * (tiled ? kSide * kSide : kWidth * kHeight), 'p');
    Binary file(false);
    file.Text(std::string_view("II*", 4));  // with a zero behind it
    file.Put(8 + static_cast<uint32_t>(pixels.size()));
    file.Text(pixels);
    const uint32_t strip = 3 * kWidth * kRows;
    using Entry = std::array<uint32_t, 4>;  // tag, type (3: 16 bits, 4: 32), count, value or where it is
    std::vector<Entry> entries = {{256, 4, 1, kWidth}, {257, 4, 1, kHeight}, {258, 3, 1, 8},
                                  {259, 3, 1, 1},      {262, 3, 1, 2},       {277, 3, 1, 3}};
    const uint32_t behind = 8 + static_cast<uint32_t>(pixels.size()) + 2 + 12 * (tiled ? 10 : 9) + 4;
    if (tiled) {
      entries.insert(
          entries.end(),
          {{322, 4, 1, kSide}, {323, 4, 1, kSide}, {324, 4, 1, 8}, {325, 4, 1, static_cast<uint32_t>(pixels.size())}});
    } else {
      entries.insert(entries.end() - 1, {273, 4, 2, behind});
      entries.insert(entries.end(), {{278, 4, 1, kRows}, {279, 4, 2, behind + 8}});
    }
    file.Put(static_cast<uint16_t>(entries.size()));
    for (const auto& [tag, type, count, value] : entries) {
      file.Put(static_cast<uint16_t>(tag));
      file.Put(static_cast<uint16_t>(type));
      file.Put(count);
      file.Put(value);
    }
    file.Put(uint32_t{0});
    for (const uint32_t number : {8u, 8 + strip, strip, strip}) {  // offsets and sizes of the two strips
      if (!tiled) file.Put(number);
    }
    seeds.push_back(file.bytes());
  }
  return seeds;
}

}  // namespace anchorsplat
