# `cmake --install` and the Debian package (cpack -G DEB in the build folder).
include(GNUInstallDirs)
install(TARGETS catoptric RUNTIME DESTINATION ${CMAKE_INSTALL_BINDIR})
# The folders keep their places beside one another, so that scripts/prepare_assets makes the rooms'
# assets (which are not installed) here, or in a user's copy of the whole folder.
install(DIRECTORY configs scenes paths DESTINATION ${CMAKE_INSTALL_DATADIR}/catoptric
  PATTERN scenes/assets EXCLUDE)
install(PROGRAMS scripts/prepare_assets DESTINATION ${CMAKE_INSTALL_DATADIR}/catoptric/scripts)
install(DIRECTORY scripts/assets DESTINATION ${CMAKE_INSTALL_DATADIR}/catoptric/scripts
  PATTERN __pycache__ EXCLUDE)
# The pages keep their places beside one another too, so that the links between them hold.
install(FILES CONTRIBUTING.md LICENSE NOTICE README.md DESTINATION ${CMAKE_INSTALL_DOCDIR})
install(DIRECTORY docs DESTINATION ${CMAKE_INSTALL_DOCDIR}
  PATTERN docs/man EXCLUDE PATTERN docs/completion EXCLUDE)
install(FILES docs/man/catoptric.1 DESTINATION ${CMAKE_INSTALL_MANDIR}/man1)
install(FILES docs/completion/catoptric.bash RENAME catoptric
  DESTINATION ${CMAKE_INSTALL_DATADIR}/bash-completion/completions)
install(FILES docs/completion/_catoptric DESTINATION ${CMAKE_INSTALL_DATADIR}/zsh/vendor-completions)
foreach(folder scenes src/methods)
  file(GLOB_RECURSE pages RELATIVE ${PROJECT_SOURCE_DIR} CONFIGURE_DEPENDS ${folder}/*.md)
  list(FILTER pages EXCLUDE REGEX "^scenes/assets/")
  foreach(page ${pages})
    get_filename_component(place ${page} DIRECTORY)
    install(FILES ${page} DESTINATION ${CMAKE_INSTALL_DOCDIR}/${place})
  endforeach()
endforeach()

set(CPACK_GENERATOR DEB)
set(CPACK_PACKAGE_NAME catoptric)
set(CPACK_PACKAGE_CONTACT "the catoptric authors")
set(CPACK_PACKAGE_DESCRIPTION_SUMMARY "${PROJECT_DESCRIPTION}")
set(CPACK_PACKAGE_VERSION ${PROJECT_VERSION})
set(CPACK_DEBIAN_FILE_NAME DEB-DEFAULT)
set(CPACK_DEBIAN_PACKAGE_SECTION graphics)
set(CPACK_DEBIAN_PACKAGE_SHLIBDEPS ON)
set(CPACK_DEBIAN_PACKAGE_DEPENDS "fonts-dejavu-core")
set(CPACK_DEBIAN_PACKAGE_RECOMMENDS "libegl1, libegl-mesa0, libgl1-mesa-dri, libosmesa6")
# What prepare_assets needs
set(CPACK_DEBIAN_PACKAGE_SUGGESTS
  "sweethome3d-furniture, assimp-utils, openimageio-tools, python3")
# Written modes are the package's, whatever the umask of who builds it.
set(CPACK_INSTALL_DEFAULT_DIRECTORY_PERMISSIONS
  OWNER_READ OWNER_WRITE OWNER_EXECUTE GROUP_READ GROUP_EXECUTE WORLD_READ WORLD_EXECUTE)
set(CPACK_RESOURCE_FILE_LICENSE ${PROJECT_SOURCE_DIR}/LICENSE)
set(CPACK_STRIP_FILES ON)
include(CPack)
