"""A scene becomes the files of another renderer, and those files its picture."""
