"""What is ours on a disk, and how it gets there: files, folders and sets of files that are replaced in one step, locks, and the one
check of every path that a user gives. Nothing here knows what the files hold; whatever writes or reads comes in through here.
"""
