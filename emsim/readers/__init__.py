"""Readers of files that other programs write, one format a file: bytes in, plain numbers out."""
