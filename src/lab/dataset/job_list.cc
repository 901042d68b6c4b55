#include "dataset/job_list.h"

#include <filesystem>
#include <map>
#include <set>

#include "core/text.h"
#include "dataset/object_name.h"
#include "scene/mesh_reader.h"

namespace anchorsplat {

namespace {

// Known object names without the suffix of the recipe's entry, by mesh.
std::map<std::string, std::string> KnownNames(const Recipe& recipe, const Manifest& there,
                                              const std::vector<ObjectFailure>& failed) {
  std::map<std::string, std::string> names;
  const auto learn = [&](std::string name, const std::string& source) {
    for (const RecipeEntry& entry : recipe.entries) {
      const std::string ending = "--" + entry.name;
      if (recipe.NamesEntries() && name.ends_with(ending)) {
        name.resize(name.size() - ending.size());
        break;
      }
    }
    names.emplace(source, name);
  };
  for (const auto& [name, record] : there) learn(name, record.source);
  for (const ObjectFailure& failure : failed) {
    if (failure.stage != kReadStage) learn(failure.name, failure.source);
  }
  return names;
}

// "chair" for "models/chair/model.obj"; empty if the address has no folder.
std::string FolderOf(const std::string& address) {
  return std::filesystem::path(address.substr(0, address.rfind(".sh3f#"))).parent_path().filename().string();
}

// Makes a name unique and reserves it.
std::string TakeName(std::string name, std::set<std::string>& taken) {
  const std::string base = name;
  for (int i = 2; !taken.insert(name).second; ++i) name = Cat(base, "-", i);
  return name;
}

}  // namespace

JobList ListJobs(const std::vector<std::string>& meshes, const Recipe& recipe, const Manifest& there,
                 const std::vector<ObjectFailure>& failed) {
  JobList list;
  std::set<std::string> addresses;
  std::map<std::string, int64_t> places;          // index in the list, by address
  std::map<std::string, std::string> unreadable;  // error, by library
  for (std::string mesh : meshes) {
    while (mesh.size() > 1 && mesh.back() == '/') mesh.pop_back();  // a folder of pictures
    const auto expanded = ExpandMeshAddress(mesh);
    if (expanded.ok()) {
      for (const std::string& address : *expanded) {
        if (addresses.insert(address).second) places.emplace(address, std::ssize(places));
      }
    } else {
      unreadable.emplace(mesh, expanded.error().message);
    }
  }

  const auto known = KnownNames(recipe, there, failed);
  std::set<std::string> taken;
  std::map<std::string, std::vector<std::string>> fresh;  // meshes without a name yet, by preferred name
  std::map<std::string, std::string> names;               // by mesh
  for (const std::string& address : addresses) {
    const auto found = known.find(address);
    if (found != known.end() && taken.insert(found->second).second) {
      names[address] = found->second;
    } else {
      fresh[ObjectName(address)].push_back(address);
    }
  }
  for (const auto& [name, wanting] : fresh) {
    if (wanting.size() == 1 && taken.insert(name).second) names[wanting[0]] = name;
  }
  for (const auto& [name, wanting] : fresh) {
    for (const std::string& address : wanting) {
      if (names.count(address) > 0) continue;
      const std::string folder = SafeName(FolderOf(address));
      names[address] = TakeName(folder.empty() ? name : folder + "-" + name, taken);
    }
  }

  std::map<std::string, ObjectJob> jobs;
  for (const auto& [address, name] : names) {
    const auto folder = [&](const std::string& entry) {
      return recipe.NamesEntries() ? SafeName(Cat(name, "--", entry)) : name;
    };
    for (const size_t drawn : DrawEntries(recipe, name, places.at(address))) {
      const RecipeEntry& entry = recipe.entries[drawn];
      ObjectJob job;
      job.name = folder(entry.name);
      job.source = address;
      job.recipe = entry.name;
      job.settings = entry.settings;
      if (entry.settings.IsDerived()) job.base = folder(entry.settings.from);
      taken.insert(job.name);
      jobs.emplace(job.name, std::move(job));
    }
  }
  for (auto& [name, job] : jobs) list.jobs.push_back(std::move(job));
  for (const auto& [library, why] : unreadable) {
    const std::string name = SafeName(std::filesystem::path(library).filename().string());
    list.failures.push_back({TakeName(name.empty() ? "library" : name, taken), library, kReadStage, why});
  }
  return list;
}

}  // namespace anchorsplat
