"""One renderer a file; a file in this folder is the registration. What each must offer: `translator.contract`."""
