# `cmake --install` and the Debian packages. Component `programs` is what runs a deployment;
# component `development` is for programs that use the hull library or the message types.
include(GNUInstallDirs)
include(CMakePackageConfigHelpers)

# Programs of general names, such as capture_node, are not in the search path: `fivepipe` starts
# them from its own folder, where it also looks for the optional modules.
set(fivepipe_programs_dir lib/fivepipe)
set(fivepipe_programs fivepipe capture_node recon_node sim_node render_node fivepipe_cameras
  fivepipe_export fivepipe_maps fivepipe_segment fivepipe_study fivepipe_measure)
set(fivepipe_modules fivepipe_images fivepipe_video)
foreach(module fivepipe_genicam fivepipe_gstreamer)
  if(TARGET ${module})
    list(APPEND fivepipe_modules ${module})
  endif()
endforeach()
install(TARGETS ${fivepipe_programs} RUNTIME DESTINATION ${fivepipe_programs_dir}
  COMPONENT programs)
install(TARGETS ${fivepipe_modules} LIBRARY DESTINATION ${fivepipe_programs_dir}
  COMPONENT programs)
# Open CASCADE and its dependencies need 150 MB, so its module is a package of its own.
set(fivepipe_packages programs development)
if(TARGET fivepipe_step)
  list(APPEND fivepipe_packages step)
  list(APPEND fivepipe_modules fivepipe_step)
  install(TARGETS fivepipe_step LIBRARY DESTINATION ${fivepipe_programs_dir} COMPONENT step)
endif()
install(CODE [[
  set(bin "$ENV{DESTDIR}${CMAKE_INSTALL_PREFIX}/bin")
  file(MAKE_DIRECTORY "${bin}")
  file(CREATE_LINK ../lib/fivepipe/fivepipe "${bin}/fivepipe" SYMBOLIC)
]] COMPONENT programs)

# Deployments name rigs and scenes by relative paths, so the folders keep their places.
install(DIRECTORY launch/deployments launch/profiles DESTINATION share/fivepipe/launch
  COMPONENT programs)
install(DIRECTORY scenes DESTINATION share/fivepipe COMPONENT programs)
# The documents link each other and their pictures by relative paths, too.
install(FILES README.md CHANGELOG.md CONTRIBUTING.md LICENSE DESTINATION ${CMAKE_INSTALL_DOCDIR}
  COMPONENT programs)
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR} COMPONENT programs)
# The libraries in the page that `fivepipe study` writes.
install(FILES common/study/report/libraries/licences.txt DESTINATION ${CMAKE_INSTALL_DOCDIR}
  COMPONENT programs)
install(FILES launch/installed/fivepipe.bash DESTINATION share/bash-completion/completions
  RENAME fivepipe COMPONENT programs)

# systemd and sysctl read these below /usr, /usr/local and /etc.
install(CODE "set(unit \"${CMAKE_SOURCE_DIR}/launch/installed/fivepipe@.service\")"
  COMPONENT programs)
install(CODE [[
  # `cmake --install --prefix` decides only now; the package is made in a folder, for /usr.
  set(prefix "${CMAKE_INSTALL_PREFIX}")
  if(prefix MATCHES "/_CPack_Packages/")
    set(prefix /usr)
  endif()
  configure_file("${unit}.in"
    "$ENV{DESTDIR}${CMAKE_INSTALL_PREFIX}/lib/systemd/system/fivepipe@.service" @ONLY)
]] COMPONENT programs)
install(FILES launch/installed/05-fivepipe.conf DESTINATION lib/sysctl.d COMPONENT programs)

# find_package(fivepipe): fivepipe::hull and fivepipe::messages.
set(fivepipe_exported fivepipe_options fivepipe_base fivepipe_geometry fivepipe_hull
  fivepipe_hull_cpu fivepipe_hull_query fivepipe_hull_oracle fivepipe_hull_silhouette
  fivepipe_hull_coverage fivepipe_idl)
install(TARGETS ${fivepipe_exported} EXPORT fivepipe
  ARCHIVE DESTINATION ${CMAKE_INSTALL_LIBDIR} COMPONENT development)
install(EXPORT fivepipe NAMESPACE fivepipe:: FILE fivepipeTargets.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/fivepipe COMPONENT development)
install(DIRECTORY common/base common/geometry common/hull
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/fivepipe/common COMPONENT development
  FILES_MATCHING PATTERN "*.h" PATTERN "gl" EXCLUDE PATTERN "paper" EXCLUDE)
install(FILES ${CMAKE_BINARY_DIR}/idl/fivepipe.h
  DESTINATION ${CMAKE_INSTALL_INCLUDEDIR}/fivepipe COMPONENT development)
configure_package_config_file(cmake/fivepipeConfig.cmake.in installed/fivepipeConfig.cmake
  INSTALL_DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/fivepipe)
write_basic_package_version_file(${CMAKE_BINARY_DIR}/installed/fivepipeConfigVersion.cmake
  COMPATIBILITY SameMinorVersion)
install(FILES ${CMAKE_BINARY_DIR}/installed/fivepipeConfig.cmake
  ${CMAKE_BINARY_DIR}/installed/fivepipeConfigVersion.cmake
  DESTINATION ${CMAKE_INSTALL_LIBDIR}/cmake/fivepipe COMPONENT development)

# What `cmake --install` needs, and nothing else.
add_custom_target(installed DEPENDS ${fivepipe_programs} ${fivepipe_modules} ${fivepipe_exported})

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME fivepipe)
set(CPACK_PACKAGE_VENDOR "the fivepipe developers")
set(CPACK_PACKAGE_CONTACT "the fivepipe developers <fivepipe@localhost>")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY
  "real objects, seen by fixed cameras, live in a virtual environment")
set(CPACK_PACKAGING_INSTALL_PREFIX /usr)
set(CPACK_COMPONENTS_ALL ${fivepipe_packages})
set(CPACK_DEB_COMPONENT_INSTALL ON)
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION science)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_NAME fivepipe)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_SHLIBDEPS ON)
# For the kernel settings that postinst applies at once.
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_RECOMMENDS "procps")
# EGL and its driver are loaded at run time, so the programs do not name them.
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_DEPENDS "libegl1, libgl1-mesa-dri")
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_CONTROL_EXTRA ${CMAKE_SOURCE_DIR}/launch/installed/postinst
  ${CMAKE_SOURCE_DIR}/launch/installed/prerm)
set(CPACK_DEBIAN_PROGRAMS_PACKAGE_CONTROL_STRICT_PERMISSION ON)
set(CPACK_DEBIAN_STEP_PACKAGE_NAME fivepipe-step)
set(CPACK_DEBIAN_STEP_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_STEP_PACKAGE_DEPENDS "fivepipe (= ${PROJECT_VERSION})")
set(CPACK_COMPONENT_STEP_DESCRIPTION "STEP files as meshes of fivepipe, by Open CASCADE")
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_NAME fivepipe-dev)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_SECTION libdevel)
set(CPACK_DEBIAN_DEVELOPMENT_PACKAGE_DEPENDS
  "cmake, pkg-config, libeigen3-dev, libfmt-dev, libhwy-dev, cyclonedds-dev")
set(CPACK_COMPONENT_DEVELOPMENT_DESCRIPTION
  "hull library and message types of fivepipe, for find_package(fivepipe)")
set(CPACK_STRIP_FILES ON)
include(CPack)
