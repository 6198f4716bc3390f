"""The papers' scenarios, each as printed and, where it differs, as computed."""
