# What `cmake --install`, `make install` and `make deb` put where. Everything the program needs to work is inside of it
# (network, page of `view`), so the rest is what people and their shells read.
#
# LPIPS plugin and trainer need LibTorch at run time. They are installed only with a LibTorch that stays where it is: one
# outside of this checkout, named by -DTorch_DIR=…; that of .venv would be gone with the checkout.
include(GNUInstallDirs)

install(TARGETS anchorsplat RUNTIME DESTINATION "${CMAKE_INSTALL_BINDIR}")

# The library, for find_package(anchorsplat).
if(TARGET anchorsplat_shared)
  include(CMakePackageConfigHelpers)
  set(package_dir "${CMAKE_INSTALL_LIBDIR}/cmake/anchorsplat")
  write_basic_package_version_file("${CMAKE_BINARY_DIR}/anchorsplatConfigVersion.cmake" COMPATIBILITY SameMinorVersion)
  install(TARGETS anchorsplat_shared EXPORT anchorsplat LIBRARY DESTINATION "${CMAKE_INSTALL_LIBDIR}")
  install(DIRECTORY include/anchorsplat DESTINATION "${CMAKE_INSTALL_INCLUDEDIR}" FILES_MATCHING PATTERN "*.h")
  install(EXPORT anchorsplat NAMESPACE anchorsplat:: FILE anchorsplatTargets.cmake DESTINATION "${package_dir}")
  install(FILES cmake/anchorsplatConfig.cmake "${CMAKE_BINARY_DIR}/anchorsplatConfigVersion.cmake"
          DESTINATION "${package_dir}")
endif()

install(PROGRAMS scripts/fetch-upscaler.sh scripts/convert_upscaler.py DESTINATION share/anchorsplat)
if(ANCHORSPLAT_TORCH)
  get_filename_component(torch_place "${Torch_DIR}" REALPATH)
  string(FIND "${torch_place}/" "${CMAKE_SOURCE_DIR}/" in_checkout)
  if(in_checkout EQUAL 0)
    message(STATUS "To be installed: without LPIPS and training, whose LibTorch lies in this checkout")
  else()
    # core/companion.h looks for them there.
    set_target_properties(anchorsplat_lpips anchorsplat_train_program PROPERTIES INSTALL_RPATH "${torch_root}/lib")
    install(TARGETS anchorsplat_lpips anchorsplat_train_program
            RUNTIME DESTINATION lib/anchorsplat LIBRARY DESTINATION lib/anchorsplat)
    install(PROGRAMS scripts/fetch-lpips.sh scripts/convert_lpips.py DESTINATION lib/anchorsplat)
  endif()
endif()

# Manual page and completions come from the verbs' own declarations: the program prints them.
set(made "${CMAKE_BINARY_DIR}/installed")
set(third_party "${made}/THIRD_PARTY")
set(documents "${made}/anchorsplat.1" "${made}/anchorsplat.bash" "${made}/_anchorsplat" "${third_party}")
if(CMAKE_CROSSCOMPILING AND NOT CMAKE_CROSSCOMPILING_EMULATOR)
  set(third_party THIRD_PARTY)
  message(STATUS "To be installed: without manual page and completions, which the program itself prints "
                 "(CMAKE_CROSSCOMPILING_EMULATOR would let it)")
else()
  add_custom_command(
    OUTPUT ${documents}
    COMMAND ${CMAKE_COMMAND} -E make_directory "${made}"
    COMMAND anchorsplat manual man > "${made}/anchorsplat.1"
    COMMAND anchorsplat manual bash > "${made}/anchorsplat.bash"
    COMMAND anchorsplat manual zsh > "${made}/_anchorsplat"
    COMMAND "${CMAKE_SOURCE_DIR}/scripts/third-party.sh" "$<TARGET_FILE:anchorsplat>" > "${third_party}"
    DEPENDS anchorsplat scripts/third-party.sh scripts/webgpu-headers.notice THIRD_PARTY
    VERBATIM)
  add_custom_target(anchorsplat_documents ALL DEPENDS ${documents})
  install(FILES "${made}/anchorsplat.1" DESTINATION "${CMAKE_INSTALL_MANDIR}/man1")
  install(FILES "${made}/anchorsplat.bash" DESTINATION "${CMAKE_INSTALL_DATADIR}/bash-completion/completions"
          RENAME anchorsplat)
  # Debian's zsh looks into one folder for what packages bring and into another for everything else.
  install(CODE "
    set(folder site-functions)
    if(CMAKE_INSTALL_PREFIX STREQUAL \"/usr\")
      set(folder vendor-completions)
    endif()
    file(INSTALL DESTINATION \"\${CMAKE_INSTALL_PREFIX}/${CMAKE_INSTALL_DATADIR}/zsh/\${folder}\"
         TYPE FILE FILES \"${made}/_anchorsplat\")")
endif()
install(FILES "${third_party}" CHANGELOG.md DESTINATION "${CMAKE_INSTALL_DOCDIR}")
install(FILES LICENSE DESTINATION "${CMAKE_INSTALL_DOCDIR}" RENAME copyright)
install(FILES models/README.md DESTINATION "${CMAKE_INSTALL_DOCDIR}" RENAME model-card.md)

# What the above needs to be built, and no tests: for `make install` and `make deb`.
add_custom_target(anchorsplat_installable DEPENDS anchorsplat)
if(TARGET anchorsplat_documents)
  add_dependencies(anchorsplat_installable anchorsplat_documents)
endif()
if(TARGET anchorsplat_shared)
  add_dependencies(anchorsplat_installable anchorsplat_shared)
endif()

if(NOT ANCHORSPLAT_SANITIZE AND ANCHORSPLAT_LAB)  # it asks for the verbs of the lab, too
  add_test(NAME cli.install
           COMMAND ${CMAKE_SOURCE_DIR}/src/doors/cli/behaviour/install_test.sh $<TARGET_FILE:anchorsplat> ${CMAKE_SOURCE_DIR}
                   ${CMAKE_BINARY_DIR} ${CMAKE_COMMAND})
  set_tests_properties(cli.install PROPERTIES COST 100)
  if(TARGET anchorsplat_shared)
    add_test(NAME api.installed_package
             COMMAND ${CMAKE_SOURCE_DIR}/src/doors/api/installed_package_test.sh ${CMAKE_SOURCE_DIR} ${CMAKE_BINARY_DIR}
                     ${CMAKE_COMMAND} ${CMAKE_CXX_COMPILER} ${CMAKE_NM})
  endif()
endif()

# `make deb`. What the program is linked with becomes its dependencies, by dpkg-shlibdeps.
set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME anchorsplat)
set(CPACK_PACKAGE_CONTACT "anchorsplat maintainers <maintainers@anchorsplat.invalid>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "make a 3D Gaussian splat hold up when seen closer")
set(CPACK_PACKAGE_DESCRIPTION "\
A 3D Gaussian splat trained on small pictures falls apart when it is seen closer
than they were. anchorsplat returns one that holds up at four times their
resolution, with nothing but the splat as input. It also renders, compares,
converts and fits splats.")
set(CPACK_PACKAGE_DIRECTORY "${ANCHORSPLAT_PROGRAM_DIR}")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_STRIP_FILES ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
include(CPack)
