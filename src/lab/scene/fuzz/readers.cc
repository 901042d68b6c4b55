#include "formats/fuzz/readers.h"

#include <cstdio>
#include <cstdlib>
#include <fstream>
#include <utility>

#include "core/text.h"
#include "io/file_bytes_for_test.h"
#include "scene/assets_for_test.h"
#include "scene/furniture_catalog.h"
#include "scene/mesh_import.h"
#include "scene/mesh_summary.h"
#include "scene/texture_decoder.h"

namespace anchorsplat {

namespace {

namespace fs = std::filesystem;

// An accepted input that should not have been is a bug like a crash, and is reported like one.
void Require(bool condition, const char* what) {
  if (condition) return;
  std::fprintf(stderr, "a reader accepted a file and gave %s\n", what);
  std::abort();
}

// A file of a megabyte cannot be worth more.
MeshReadOptions SmallLimits() {
  MeshReadOptions options;
  options.limits.max_vertices = 1 << 20;
  options.limits.max_polygon = 1000;
  options.limits.max_texture_pixels = 1 << 20;
  options.limits.max_textures_pixels = 1 << 22;
  options.limits.max_cpu_seconds = 1;  // the supervisor takes 20 s for a hang
  return options;
}

Status Import(const AssetSource& assets, const std::string& name) {
  auto imported = ImportMesh(assets, name, name, SmallLimits());
  if (!imported.ok()) {
    Require(imported.error().message.starts_with(name), "an error that does not name the file");
    return imported.error();
  }
  Require(Validate(imported->mesh).ok(), "a mesh whose arrays disagree");
  Require(!imported->mesh.triangles.empty(), "a mesh without triangles");
  (void)Summarize(std::move(imported->mesh));
  return {};
}

const char* const kObj =
    "# a comment\nmtllib a.mtl\no part\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0 0.5 0.5 0.5\nvt 0 0\nvt 1 0\nvt 1 1\nvt 0 "
    "1\n"
    "vn 0 0 1\ng side\ns 1\nusemtl m\nf 1/1/1 2/2/1 3/3/1 4/4/1\nusemtl n\nf -4//1 -3//1 -2//1\nf 1 2 3\nl 1 2\np 3\n";
const char* const kMtl =
    "newmtl m\nKa 1 1 1\nKd 0.5 0.5 0.5\nKs 0 0 0\nNs 10\nd 0.5\nillum 2\nmap_Kd -s 2 2 1 -o 0.1 0 0 a.png\n"
    "map_d a.png\nmap_Bump -bm 0.5 a.png\n\nnewmtl n\nKd 1 0 0\nTr 0.5\n";
const char* const kPly =
    "ply\nformat ascii 1.0\ncomment x\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n"
    "property float s\nproperty float t\nproperty uchar red\nproperty uchar green\nproperty uchar blue\n"
    "element face 2\nproperty list uchar int vertex_indices\nend_header\n0 0 0 0 0 1 2 3\n1 0 0 0 1 4 5 6\n"
    "1 1 0 1 1 7 8 9\n0 1 0 1 0 1 1 1\n3 0 1 2\n4 0 1 2 3\n";
const char* const kAc =
    "AC3Db\nMATERIAL \"m\" rgb 1 1 1 amb 1 1 1 emis 0 0 0 spec 0 0 0 shi 0 trans 0.25\nOBJECT world\nkids 2\n"
    "OBJECT poly\nname \"part\"\ndata 4\nsome\nloc 0 5 0\nrot 1 0 0 0 1 0 0 0 1\ntexture \"a.png\"\ntexrep 2 2\n"
    "texoff 0.5 0\ncrease 45\nsubdiv 2\nnumvert 4\n0 0 0\n1 0 0\n1 1 0\n0 1 0\nnumsurf 2\nSURF 0x20\nmat 0\nrefs 4\n"
    "0 0 0\n1 1 0\n2 1 1\n3 0 1\nSURF 0x30\nmat 0\nrefs 3\n0 0 0\n1 1 0\n2 1 1\nkids 0\nOBJECT group\nkids 0\n";
const char* const kStl =
    "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid "
    "a\n";
const char* const kOff = "OFF\n4 2 0\n0 0 0\n1 0 0\n1 1 0\n0 1 0\n3 0 1 2\n4 0 1 2 3\n";
const char* const kDae =
    "<?xml version=\"1.0\"?><COLLADA xmlns=\"http://www.collada.org/2005/11/COLLADASchema\" version=\"1.4.1\"><asset>"
    "<unit meter=\"1\"/><up_axis>Z_UP</up_axis></asset><library_images><image id=\"i\"><init_from>a.png</init_from>"
    "</image></library_images><library_effects><effect id=\"e\"><profile_COMMON><newparam sid=\"s\"><surface "
    "type=\"2D\"><init_from>i</init_from></surface></newparam><newparam sid=\"t\"><sampler2D><source>s</source>"
    "</sampler2D></newparam><technique sid=\"c\"><lambert><diffuse><texture texture=\"t\" texcoord=\"UV\"/></diffuse>"
    "</lambert></technique></profile_COMMON></effect></library_effects><library_materials><material id=\"m\">"
    "<instance_effect url=\"#e\"/></material></library_materials><library_geometries><geometry id=\"g\"><mesh>"
    "<source id=\"p\"><float_array id=\"pa\" count=\"9\">0 0 0 1 0 0 0 1 0</float_array><technique_common><accessor "
    "source=\"#pa\" count=\"3\" stride=\"3\"><param name=\"X\" type=\"float\"/><param name=\"Y\" type=\"float\"/>"
    "<param name=\"Z\" type=\"float\"/></accessor></technique_common></source><vertices id=\"v\"><input "
    "semantic=\"POSITION\" source=\"#p\"/></vertices><triangles count=\"1\" material=\"mm\"><input "
    "semantic=\"VERTEX\" source=\"#v\" offset=\"0\"/><p>0 1 2</p></triangles></mesh></geometry></library_geometries>"
    "<library_visual_scenes><visual_scene id=\"w\"><node><matrix>1 0 0 0 0 1 0 0 0 0 1 0 0 0 0 1</matrix>"
    "<instance_geometry url=\"#g\"><bind_material><technique_common><instance_material symbol=\"mm\" target=\"#m\"/>"
    "</technique_common></bind_material></instance_geometry></node></visual_scene></library_visual_scenes><scene>"
    "<instance_visual_scene url=\"#w\"/></scene></COLLADA>";

// The glTF of the tests in one binary file.
std::string Glb() {
  std::string json =
      R"({"asset":{"version":"2.0"},"scene":0,"scenes":[{"nodes":[0]}],"nodes":[{"mesh":0}],"meshes":[{"primitives":)"
      R"([{"attributes":{"POSITION":0},"indices":1}]}],"buffers":[{"byteLength":44}],"bufferViews":[{"buffer":0,)"
      R"("byteOffset":0,"byteLength":36},{"buffer":0,"byteOffset":36,"byteLength":6}],"accessors":[{"bufferView":0,)"
      R"("componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],"max":[1,1,0]},{"bufferView":1,"componentType":)"
      R"(5123,"count":3,"type":"SCALAR"}]})";
  while (json.size() % 4 != 0) json += ' ';
  std::string buffer;
  for (const float v : {0.0f, 0.0f, 0.0f, 1.0f, 0.0f, 0.0f, 0.0f, 1.0f, 0.0f}) {
    buffer.append(reinterpret_cast<const char*>(&v), 4);
  }
  buffer += std::string("\0\0\1\0\2\0\0\0", 8);
  const auto u32 = [](size_t value) {
    std::string bytes;
    for (int shift = 0; shift < 32; shift += 8) bytes += static_cast<char>(value >> shift & 255);
    return bytes;
  };
  return "glTF" + u32(2) + u32(12 + 8 + json.size() + 8 + buffer.size()) + u32(json.size()) + "JSON" + json +
         u32(buffer.size()) + std::string("BIN\0", 4) + buffer;
}

// One file is damaged, what it refers to stays good.
void AddMeshes(std::vector<FuzzReader>& readers) {
  const auto add = [&](const std::string& name, std::vector<std::string> seeds, std::vector<std::string_view> words) {
    readers.push_back({name, std::move(seeds), std::move(words), [name](const std::string& bytes) {
                         MapAssets assets;
                         assets.files = {{"a.mtl", kMtl}, {"a.png", GreyPng(0.5f)}, {name, bytes}};
                         return Import(assets, name);
                       }});
  };
  add("fuzz.obj", {kObj}, {"f ", "v ", "vt ", "vn ", "usemtl ", "/", "//", "g ", "o ", "\\\n", "l ", "s off"});
  add("fuzz.gltf", {TriangleGltf("{}"), TriangleGltf(R"({"pbrMetallicRoughness":{"baseColorTexture":{"index":0}}})")},
      {"\"count\":", "\"byteLength\":", "\"byteStride\":", "\"sparse\":{}", "\"children\":[0]", "[]", "{}", "null",
       "\"indices\":0", "\"mode\":", "\"uri\":\"a.png\"", "\"skin\":0"});
  add("fuzz.glb", {Glb()}, {"JSON", "BIN", "\"count\":", "\"byteOffset\":"});
  add("fuzz.ply", {kPly}, {"element ", "property ", "list ", "uchar ", "double ", "binary_little_endian", "face"});
  add("fuzz.dae", {kDae}, {"<node>", "</node>", "count=\"", "offset=\"", "<p>", "</p>", "#g", "#p"});
  add("fuzz.ac", {kAc}, {"kids ", "numvert ", "numsurf ", "refs ", "OBJECT ", "mat ", "data ", "\""});
  add("fuzz.stl", {kStl}, {"facet", "vertex", "endsolid", "solid "});
  add("fuzz.off", {kOff}, {"OFF", "STOFF", "COFF", "\n"});
  readers.push_back(
      {"fuzz.mtl", {kMtl}, {"map_Kd ", "newmtl ", "-s ", "-clamp on", "Kd "}, [](const std::string& bytes) {
         MapAssets assets;
         assets.files = {{"a.obj", kObj}, {"a.png", GreyPng(0.5f)}, {"a.mtl", bytes}};
         return Import(assets, "a.obj");
       }});
}

void AddPictures(std::vector<FuzzReader>& readers) {
  const auto add = [&](const std::string& name, std::vector<std::string> seeds) {
    readers.push_back({name, std::move(seeds), {}, [name](const std::string& bytes) {
                         const auto texture = DecodeTexture(name, bytes, 1 << 20);
                         if (!texture.ok()) return Status(texture.error());
                         Require(texture->rgba.size() == size_t{4} * static_cast<size_t>(texture->width) *
                                                             static_cast<size_t>(texture->height),
                                 "a picture of another size");
                         return Status();
                       }});
  };
  std::string packed = SgiBytes(2, 1, 1, {});
  packed[2] = 1;
  packed += std::string("\0\0\2\x08\0\0\0\2\2\7", 10);
  add("fuzz.rgb", {SgiBytes(2, 2, 3, {1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12}), packed});
  std::string tga(18, '\0');
  tga[2] = 2;
  tga[12] = tga[14] = 2;
  tga[16] = 24;
  std::string tga_packed = tga + "\x83\1\2\3";
  tga_packed[2] = 10;
  add("fuzz.tga", {tga + std::string(12, '\7'), tga_packed});
  std::string bmp(54, '\0');
  bmp.replace(0, 2, "BM");
  bmp[10] = 54;
  bmp[14] = 40;
  bmp[18] = bmp[22] = 2;
  bmp[26] = 1;
  bmp[28] = 24;
  add("fuzz.bmp", {bmp + std::string(16, '\7')});
}

// The list in a furniture library; and the archive itself.
void AddLibraries(const fs::path& folder, std::vector<FuzzReader>& readers) {
  const std::string list = "# Free\nname=L\nname#1=A\\u00e9\nmodel#1=/a/a.obj\nmodelRotation#1=1 0 0 0 1 0 0 0 1\n";
  const fs::path path = folder / "fuzz.sh3f";
  const auto write = [path](const std::string& properties) {
    auto file = OutputFile::Create(path, true);
    ZipWriter zip(*file);
    (void)zip.Add("PluginFurnitureCatalog.properties", properties);
    (void)zip.Add("a/a.obj", kObj);
    (void)zip.Add("a/LICENSE.txt", "Creative Commons Attribution 3.0");
    (void)zip.Finish();
    (void)file->Commit();
  };
  const auto read = [path]() -> Status {
    const auto catalog = FurnitureCatalog::Open(path);
    if (!catalog.ok()) return catalog.error();
    for (const CatalogEntry& entry : catalog->entries()) {
      const auto mesh = catalog->Read(entry, SmallLimits());
      Require(!mesh.ok() || Validate(mesh->mesh).ok(), "a mesh whose arrays disagree");
    }
    return {};
  };
  readers.push_back({"library list", {list}, {"#1=", "model#", "\\u", "\\\n"}, [=](const std::string& bytes) {
                       write(bytes);
                       return read();
                     }});
  write(list);
  readers.push_back({"library", {FileBytes(path)}, {}, [=](const std::string& bytes) {
                       fs::remove(path);
                       std::ofstream(path, std::ios::binary) << bytes;
                       return read();
                     }});
}

}  // namespace

std::vector<FuzzReader> FuzzReaders(const fs::path& folder) {
  std::vector<FuzzReader> readers;
  AddMeshes(readers);
  AddPictures(readers);
  AddLibraries(folder, readers);
  return readers;
}

}  // namespace anchorsplat
